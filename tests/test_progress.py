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
