import pytest

from omni_envs.errors import (
    FileFormatError,
    InvalidDataError,
    InvalidOptionError,
    InvalidValueError,
    MissingDependencyError,
    OmniEnvsError,
    RenderingError,
    UnknownNameError,
)


def test_unknown_name_lists_the_valid_ones_and_the_nearest():
    error = UnknownNameError("robot", "g11", ["h1", "g1"])
    assert "robot 'g11'" in str(error) and "g1, h1" in str(error)
    assert "Did you mean 'g1'" in str(error)


def test_unknown_name_without_a_near_one_does_not_guess():
    assert "Did you mean" not in str(UnknownNameError("robot", "zzz", ["g1"]))


def test_file_error_names_file_field_expectation_and_finding():
    message = str(FileFormatError("clip.pt", "columns", "591", "12"))
    assert message == "clip.pt: columns: expected 591; found 12."


def test_data_error_names_owner_and_field():
    message = str(InvalidDataError("Demonstration 'a'", "fps", "positive", "-1"))
    assert message == "Demonstration 'a': fps must be positive; got -1."


def test_value_error_names_option_expectation_and_finding_and_keeps_them_apart():
    error = InvalidValueError("height", "a number", "x" * 500)
    assert str(error).startswith("height: expected a number; got 'xxx") and len(str(error)) < 120
    assert isinstance(error, InvalidOptionError)
    assert (error.option, error.expected) == ("height", "a number")


def test_missing_dependency_says_how_to_install():
    assert "pip install 'omni-envs[sb3]'" in str(MissingDependencyError("torch", "sb3", "Training"))


@pytest.mark.parametrize(
    "cls",
    [
        FileFormatError, InvalidDataError, InvalidOptionError, MissingDependencyError,
        RenderingError, UnknownNameError,
    ],
)  # fmt: skip
def test_every_error_has_the_one_base(cls):
    assert issubclass(cls, OmniEnvsError)
