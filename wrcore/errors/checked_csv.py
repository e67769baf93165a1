"""CSV tables read with one clear line for whatever is wrong."""

import csv
import io
import warnings

from wrcore.errors import InputError
from wrcore.errors.input_files import check_regular

NO_NUMBER = "", "NA", "N/A", "n/a", "NaN", "nan", "NAN", "null", "NULL", "None"
"""What stands for a number that is not there."""


def read_csv_table(path, text):
    """Read a CSV file with a header line; lines that begin with # are comments, and the column ``text`` stays text, NA,
    too.

    Columns are separated by commas, semicolons or tabs, as the header is; beside the latter two, numbers may have
    decimal commas, all of them. Line ends and a byte order mark are those of any editor.
    """
    import pandas as pd

    try:
        check_regular(path)
        with open(path, encoding="utf-8-sig") as file:
            content = file.read()
        header = next((line for line in content.splitlines() if line.split("#")[0].strip()), "")
        separator = next((mark for mark in ",;\t" if mark in header), ",")
        body = content.partition(header)[2]
        decimal = "," if separator != "," and "," in body and "." not in body else "."
        names = [name.strip() for name in next(csv.reader([header], delimiter=separator, skipinitialspace=True), [])]
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # cells that the header has no name for
            frame = pd.read_csv(
                io.StringIO(content), sep=separator, names=names, header=0, index_col=False, dtype={text: str},
                skipinitialspace=True, comment="#", decimal=decimal, keep_default_na=False,
                na_values={name: NO_NUMBER for name in names if name != text},
            )  # fmt: skip
    except OSError as error:
        raise InputError(path, "", f"expected a CSV file with a header line: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(path, "", "expected a UTF-8 text file") from None
    except pd.errors.ParserWarning:
        raise InputError(path, "", f"expected {len(names)} cells in each row, as in the header, got more") from None
    except (ValueError, csv.Error) as error:  # pandas' parser errors are ValueErrors
        raise InputError(path, "", f"expected a CSV file with a header line: {error}") from None
    if text in frame:
        frame[text] = frame[text].fillna("").str.strip()
    return frame
