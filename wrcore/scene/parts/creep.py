"""Check of a scene's creep law, and the law's data for kernels."""

from typing import Any

from wrcore.contact.search.reduction import REDUCTIONS
from wrcore.creep.laws import LAWS, creep_data, named_law, user_law
from wrcore.creep.table import DEFAULT_TOLERANCE, ensure_table, kept_tables, load_table
from wrcore.errors.messages import tell


def check_creep(contact, reader):
    """Fill in defaults of a scene's creep law; raise an InputError for keys that do not belong to the law."""
    creep = contact["creep"]
    creep.setdefault("tolerance", DEFAULT_TOLERANCE)
    if creep["model"] not in LAWS:
        with reader.errors_of("contact.creep.model"):
            named_law(creep["model"], reader.laws)
        if contact["patch"] not in REDUCTIONS:
            expected = f"expected {' or '.join(REDUCTIONS)} with a creep law of your own, got {contact['patch']}:"
            expected += " set contact.patch to one of them"
            raise reader.error("contact.patch", expected)
    elif creep["model"] != "table" and contact["patch"] not in REDUCTIONS:
        expected = f"expected 'table' with contact.patch {contact['patch']}, which has creep forces of its own"
        got = f"got {creep['model']}; set contact.patch to {' or '.join(REDUCTIONS)}, which take any, beside it"
        raise reader.error("contact.creep.model", f"{expected}, {got}")
    if creep.get("k_S", 0.0) > creep.get("k_A", 1.0):
        expected = f"expected no more than k_A, {creep['k_A']:g}, got {creep['k_S']:g}"
        raise reader.error("contact.creep.k_S", expected)
    if "table" in creep:
        creep["table"] = str(reader.file(creep["table"], "contact.creep.table"))


def creep_of(scene: Any, progress: Any) -> Any:
    """Return the data of the scene's creep law; the law ``table`` loads a creep table, or builds it."""
    contact = scene.data["contact"]
    creep, nu = contact["creep"], contact["material"]["poisson_ratio"]
    factors = creep.get("k_A", 1.0), creep.get("k_S", creep.get("k_A", 1.0))
    if creep["model"] != "table":
        with scene.reader.errors_of("contact.creep.model"):
            law = None if creep["model"] in LAWS else user_law(creep["model"], scene.laws)
        return creep_data(nu, factors=factors, law=law)
    if "table" in creep:
        table = load_table(creep["table"])
    else:
        tolerance = creep["tolerance"]
        if not kept_tables(nu, creep["planes"], tolerance):
            tell(f"building a creep table ({creep['planes']}, {tolerance:g}): some ten seconds, once")
        table = ensure_table(nu, creep["planes"], tolerance, progress)
    if abs(table.nu - nu) > 1e-9:
        expected = f"expected a table for Poisson's ratio {nu:g}, got one for {table.nu:g}"
        raise scene.reader.error("contact.creep.table", expected)
    return creep_data(nu, table.kernel_data(), factors=factors)
