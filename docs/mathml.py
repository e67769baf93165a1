"""Mathematics as MathML, which browsers show by themselves: no script, no fonts, no network."""

from docutils import nodes
from sphinx.util.math import get_node_equation_number


def to_mathml(latex, block=False):
    """MathML of LaTeX.

    Parameters
    ----------
    latex : str
    block : bool
        Displayed instead of in line.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        For a command that MathML was not found for.
    """
    from latex2mathml.converter import convert

    try:
        mathml = convert(latex, display="block" if block else "inline")
    except Exception as error:  # the package raises many kinds, some without words
        raise ValueError(f"no MathML for {latex!r}: {type(error).__name__} {error}") from None
    if "\\" in mathml:
        raise ValueError(f"no MathML for {latex!r}: {mathml[mathml.index(chr(92)) :][:30]!r} is left")
    return mathml


def _inline(self, node):
    self.body.append(to_mathml(node.astext()))
    raise nodes.SkipNode


def _block(self, node):
    number = ""
    if node["number"]:
        number = f'<span class="eqno">({get_node_equation_number(self, node)})</span>'
    self.body.append(f'<div class="equation">{to_mathml(node.astext(), block=True)}{number}</div>\n')
    raise nodes.SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
