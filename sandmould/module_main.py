"""The end of a module that is run by ``python -m``: usage and bad input in a sentence."""

from __future__ import annotations

import sys
from collections.abc import Callable, Container
from typing import Any, NoReturn

from sandmould.bad_input import BadInputError


def run_main(main: Callable[..., Any], usage: str, counts: Container[int] = (0,)) -> NoReturn:
    """Call a function with the arguments of the command line, and end the process.

    Parameters
    ----------
    main : callable
        Takes the arguments as text; what it returns is the exit status.
    usage : str
        The whole command, printed for ``--help`` and when the arguments are not as many.
    counts : container of int
        How many arguments there can be.

    Raises
    ------
    SystemExit
        Always; with one sentence a problem after bad input or a file that cannot be read.
    """
    given = sys.argv[1:]
    if "-h" in given or "--help" in given:
        print(f"usage: {usage}")
        raise SystemExit(0)
    if len(given) not in counts:
        print(f"usage: {usage}", file=sys.stderr)
        raise SystemExit(2)
    raise SystemExit(in_a_sentence(main, *given))


def in_a_sentence(main: Callable[..., Any], *given: Any) -> Any:
    """Call a function; after bad input or a file that cannot be read it ends with a sentence.

    Raises
    ------
    SystemExit
        With one sentence a problem.
    """
    try:
        return main(*given)
    except BadInputError as error:
        raise SystemExit(str(error)) from None
    except OSError as error:
        if error.filename is None:  # no file of the user's: a fault of ours or of the machine
            raise
        raise SystemExit(f"{error.filename}: {error.strerror}") from None
