"""How errors are told to the user."""

import errno

import pytest

from scene_description import SceneSynthError, error_line


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (FileNotFoundError(errno.ENOENT, "No such file or directory", "room.json"), "room.json: no such file or directory; check the path"),
        (PermissionError(errno.EACCES, "Permission denied", b"/a/b"), "/a/b: permission denied; check the permissions"),
        (OSError(errno.EXDEV, "Invalid cross-device link", "/a", None, "/b"), "/a -> /b: invalid cross-device link"),
        (OSError(errno.ENOSPC, "No space left on device"), "no space left on device; free some space or choose another disk"),
        (OSError(errno.EBADF, "Bad file descriptor", 7), "bad file descriptor"),
        (OSError("libembree4.so: cannot open\nshared object"), "libembree4.so: cannot open shared object"),
        (SceneSynthError("rooms: expected 3,\n  got 4"), "rooms: expected 3, got 4"),
        (OSError(), "OSError"),
    ],
)
def test_an_error_is_one_line_without_numbers_of_the_operating_system(error: BaseException, line: str) -> None:
    assert error_line(error) == line
