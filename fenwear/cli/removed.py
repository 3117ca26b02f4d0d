"""Options and commands that were removed, and what takes their place."""

from __future__ import annotations

from collections.abc import Sequence

from fenwear.errors import CaseError, InputError

REMOVED = {
    "--posterior": "removed. Sample the posterior with emcee: docs/how-to/calibrate.md has the recipe",
    "--sobol": "removed. Compute Sobol indices with SALib: docs/how-to/calibrate.md has the recipe",
    "--jumped": "removed. Run the case twice, with --set run.integration=implicit and =jump, then compare both folders",
    "serve": "removed. Offer the model with the package umbridge: docs/how-to/other-programs.md has the script",
}


def check_removed(arguments: Sequence[str]) -> None:
    """Check that a command line has nothing that was removed.

    Raises:
        CaseError: names it, and what takes its place.
    """
    words = [word.partition("=")[0] for word in arguments]
    found = [word for at, word in enumerate(words) if word in REMOVED and (at == 0 or word.startswith("-"))]
    if found:
        raise CaseError([InputError(word, REMOVED[word]) for word in found])
