"""A renderer that is prepared by one who gives up again and again."""

from renderer.core.errors import RenderCancelled


def prepared_impatiently(renderer, view, most):
    """Prepare a view in the calling thread, as next rooms are; give up after each piece, and ask again. Return after how many times it was.

    ``most``: times after which it is taken never to end.
    """
    for asked in range(most):
        answers = iter((False, True))
        with renderer.in_this_thread():
            try:
                renderer.prepare(view, cancelled=lambda: next(answers, True))  # noqa: B023
            except RenderCancelled:
                continue
            return asked
    raise AssertionError(f"not prepared after {most} times")
