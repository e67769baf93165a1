"""CSV tables read with one clear line for whatever is wrong."""

from wrcore.errors import InputError


def read_csv_table(path, text):
    """Read a CSV file with a header line; lines that begin with # are comments.

    Parameters
    ----------
    path : path-like
    text : str
        Column that stays text (a name).

    Returns
    -------
    pandas.DataFrame

    Raises
    ------
    InputError
        If the file cannot be read as a table.
    """
    import pandas as pd

    try:
        return pd.read_csv(path, dtype={text: str}, skipinitialspace=True, comment="#")
    except OSError as error:
        raise InputError(path, "", f"expected a CSV file with a header line: {error.strerror}") from None
    except ValueError as error:  # pandas' parser errors and UnicodeDecodeError are ValueErrors
        raise InputError(path, "", f"expected a CSV file with a header line: {error}") from None
