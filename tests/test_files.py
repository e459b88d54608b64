from pathlib import Path

import pytest

from omni_envs.files import complete_file


def test_a_file_is_there_when_it_is_complete(tmp_path):
    path = tmp_path / "new" / "file.txt"
    with complete_file(path) as temporary:
        temporary.write_text("whole")
        assert not path.exists()
    assert path.read_text() == "whole" and list(path.parent.iterdir()) == [path]


def test_a_writer_that_fails_leaves_what_was_there(tmp_path):
    path = tmp_path / "file.txt"
    path.write_text("before")
    with pytest.raises(KeyboardInterrupt), complete_file(path) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]


def test_an_error_of_the_system_names_the_file(tmp_path):
    path = tmp_path / "file.txt"
    with pytest.raises(OSError) as caught, complete_file(path):
        raise OSError(28, "No space left on device")
    assert Path(caught.value.filename) == path and not list(tmp_path.iterdir())
