from omni_envs.training.display import TrainingDisplay

ROW = {
    "steps": 5e5,
    "seconds": 60.0,
    "steps_per_s": 4321.0,
    "episode_length": 50.0,
    "episode_return": 3.21,
    "body_error_m": 0.084,
}


def test_a_line_tells_speed_time_left_and_how_well_it_goes(capsys):
    with TrainingDisplay(steps=10**6, time_limit=0.0, control_dt=0.02, show=True) as display:
        display.update(ROW)
    line = capsys.readouterr().err
    for part in ("50%", "0.50 M", "4321 steps/s", "1.00 s", "3.21", "8.4 cm", "60 s left"):
        assert part in line


def test_the_object_is_told_where_there_is_one(capsys):
    with TrainingDisplay(steps=10**6, time_limit=0.0, control_dt=0.02, show=True) as display:
        display.update({**ROW, "object_error_m": 0.671})
    assert "object 67.1 cm" in capsys.readouterr().err


def test_the_time_limit_counts_where_it_comes_first(capsys):
    with TrainingDisplay(steps=10**9, time_limit=80.0, control_dt=0.02, show=True) as display:
        display.update(ROW)
    assert "75%" in (line := capsys.readouterr().err) and "20 s left" in line


def test_lines_come_now_and_then_and_at_the_end(capsys):
    with TrainingDisplay(steps=10**6, time_limit=0.0, control_dt=0.02, show=True) as display:
        for steps in (1e5, 2e5, 3e5, 1e6):
            display.update({**ROW, "steps": steps})
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and "100%" in lines[-1]


def test_nothing_is_shown_unless_asked(capsys):
    with TrainingDisplay(steps=10**6, time_limit=0.0, control_dt=0.02, show=False) as display:
        display.update(ROW)
    assert capsys.readouterr().err == ""
