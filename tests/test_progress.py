from omni_envs.progress import progress_bar


def test_bar_shows_title_count_and_unit(capsys):
    with progress_bar("Retargeting", "frames") as update:
        update(3, 10)
        update(10, 10)
    shown = capsys.readouterr().err
    assert "Retargeting" in shown and "10/10" in shown


def test_disabled_bar_is_silent(capsys):
    with progress_bar("Retargeting", disable=True) as update:
        update(1, 2)
    captured = capsys.readouterr()
    assert captured.err.strip() == "" and captured.out == ""


def test_work_that_is_done_already_shows_no_bar(capsys):
    with progress_bar("Retargeting"):
        pass
    assert capsys.readouterr().err.strip() == ""


def test_bar_is_left_behind_when_work_fails(capsys):
    try:
        with progress_bar("Retargeting") as update:
            update(1, 10)
            raise ValueError
    except ValueError:
        pass
    assert "1/10" in capsys.readouterr().err
