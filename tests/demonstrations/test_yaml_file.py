import pytest

from omni_envs.demonstrations.yaml_file import read_yaml
from omni_envs.errors import FileFormatError


def test_plain_data_and_merged_tables(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("base: &b {x: 1, y: 2}\nother:\n  <<: *b\n  x: 3\nlist: [1, {x: 1}, {x: 2}]\n")
    data = read_yaml(path)
    assert data["other"] == {"x": 3, "y": 2} and data["list"] == [1, {"x": 1}, {"x": 2}]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a: 1\nb: 2\na: 3\n", "the key 'a' twice"),
        ("a: {b: 1, b: 1}\n", "the key 'b' twice"),
        ("a: [", "expected"),
        ("a: !!python/name:os.system ''\n", "could not determine a constructor"),
        ("? [1]\n: 2\n", "unhashable"),
        ("[" * 5000, "recursion"),
        ("a: " + "9" * 5000, "4300 digits"),
        ("a: 2020-13-45", "month"),
    ],
)
def test_what_is_no_yaml(tmp_path, text, found):
    path = tmp_path / "a.yaml"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=f"a.yaml: content: expected YAML; .*{found}"):
        read_yaml(path)


def test_missing_large_and_binary_files(tmp_path):
    path = tmp_path / "a.yaml"
    with pytest.raises(FileFormatError, match="an existing YAML file"):
        read_yaml(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileFormatError, match="content: expected YAML"):
        read_yaml(path)
    path.write_text("a: 1\n" + "#" * (1 << 20))
    with pytest.raises(FileFormatError, match="at most 1 MiB"):
        read_yaml(path)
    assert read_yaml(path, 2 << 20) == {"a": 1}
