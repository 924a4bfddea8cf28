"""Puts the tables of the energy terms into docs/grammar.md.  ``make docs`` runs it."""

from pathlib import Path

from grammar.layout.energies import terms_table

PAGE = Path(__file__).resolve().parent / "grammar.md"
BEGIN, END = "<!-- energy terms -->\n", "<!-- end of energy terms -->\n"


def with_tables(text: str) -> str:
    """Return the page with the tables between its marks.

    Raises:
        ValueError: the page does not have both marks.
    """
    before, _, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not end:
        raise ValueError(f"{PAGE}: expected the lines {BEGIN.strip()} and {END.strip()}, got none; put them round the tables")
    return before + BEGIN + terms_table() + END + after


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
