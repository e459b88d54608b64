import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from omni_envs.demonstrations import Variation
from omni_envs.demonstrations.variation import HEIGHTS, POSES
from omni_envs.errors import FileFormatError
from omni_envs.generation import read_recipe

MINIMAL = {"robots": ["g1"], "sources": [{"demonstration": "box_carry"}]}


def write(tmp_path, data):
    path = tmp_path / "recipe.yaml"
    path.write_text(data if isinstance(data, str) else yaml.safe_dump(data))
    return path


def test_smallest_recipe(tmp_path):
    recipe = read_recipe(write(tmp_path, MINIMAL))
    (entry,) = recipe.sources
    assert (entry.demonstration, entry.robots) == ("box_carry", ("g1",))
    assert entry.variations == (Variation(),)
    assert (recipe.fps, recipe.refine) == (50.0, True)


def test_sets_lists_grids_and_samples(tmp_path):
    source = {
        "demonstration": "box_carry",
        "robots": ["h1", "t1"],
        "variations": [{"object_yaw": 0.5}, {}],
        "grid": {"object_yaw": [0.1, 0.2], "object_scale": [[1, 1, 1], [1.1, 1, 1]]},
        "sample": {"count": 3, "seed": 1, "ranges": {"object_translation": [[-1, -1], [1, 1]]}},
    }
    (entry,) = read_recipe(write(tmp_path, MINIMAL | {"sources": [source]})).sources
    assert entry.robots == ("h1", "t1")
    assert len(entry.variations) == 1 + 1 + 4 + 3 and entry.variations[0] == Variation()
    again = read_recipe(write(tmp_path, MINIMAL | {"sources": [source]})).sources[0]
    assert again.variations == entry.variations
    for name, whole in (("poses", POSES), ("heights", HEIGHTS)):
        source = {"demonstration": "box_carry", "variations": name}
        (entry,) = read_recipe(write(tmp_path, MINIMAL | {"sources": [source]})).sources
        assert set(entry.variations) == {Variation(), *whole}


def test_files_are_relative_to_the_recipe(tmp_path):
    (tmp_path / "clips").mkdir()
    for name in ("b.npy", "a.npy", "c.txt"):
        (tmp_path / "clips" / name).touch()
    source = {"demonstration": "clips/*.npy", "options": {"terrain_mesh": "t.obj", "height": 1.7}}
    entries = read_recipe(write(tmp_path, MINIMAL | {"sources": [source]})).sources
    assert [e.demonstration for e in entries] == [
        str(tmp_path / "clips" / n) for n in ("a.npy", "b.npy")
    ]
    assert entries[0].options == {"terrain_mesh": str(tmp_path / "t.obj"), "height": 1.7}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("", "recipe: expected a mapping"),
        ("a: [", "content: expected YAML"),
        ("!!python/object/apply:os.system ['true']", "content: expected YAML"),
        ({"robots": ["g1"]}, "recipe.sources: expected to be there"),
        ({"robots": ["r2d2"]} | {"sources": MINIMAL["sources"]}, "robots.*g1"),
        (MINIMAL | {"colour": 1}, "recipe.colour: expected one of robots, sources"),
        ("robots: [g1]\nrobots: [h1]\nsources: []", "content: .*the key 'robots' twice"),
        ("fps: " + "1" * 5000, "content: expected YAML"),
        ("fps: 2020-13-45", "content: expected YAML"),
        (MINIMAL | {"robots": ["g1", "G1"]}, "robots: expected every robot once"),
        (MINIMAL | {"robots": []}, "robots: expected a list of robot names"),
        (MINIMAL | {"fps": 0}, "fps: expected 1 to 1000 frames"),
        (MINIMAL | {"refine": "yes please"}, "refine: expected true or false"),
        (MINIMAL | {"sources": []}, "sources: expected a list"),
        (MINIMAL | {"sources": [{"demonstration": "nothing.bvh"}]}, r"sources\[0\].demonstration"),
        (MINIMAL | {"sources": [{"demonstration": 3}]}, r"sources\[0\].demonstration"),
    ],
)
def test_bad_recipes_are_refused(tmp_path, change, message):
    with pytest.raises(FileFormatError, match=rf"recipe\.yaml: {message}"):
        read_recipe(write(tmp_path, change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"options": {"colour": 1}}, "options.colour"),
        ({"options": {"height": "tall"}}, "options.height: expected a number between"),
        ({"options": {"up": "west"}}, "options.up: expected one of x, y"),
        ({"options": {"object_mesh": 3}}, "options.object_mesh: expected the name of a file"),
        ({"name": "../up"}, "name: expected letters"),
        ({"name": 3}, "name: expected letters"),
        ({"variations": "shapes"}, "poses, heights"),
        ({"variations": None}, "poses, heights"),
        ({"variations": [{"object_yaw": "left"}]}, r"variations\[0\].object_yaw: .*a number"),
        ({"variations": [{}, {"object_scale": [1, 1]}]}, r"variations\[1\].object_scale: .*3 num"),
        ({"variations": [{"yaw": 1}]}, r"variations\[0\].yaw"),
        ({"grid": {"yaw": [1]}}, "grid.yaw: expected one of object_translation"),
        ({"grid": {"object_yaw": 1}}, "grid.object_yaw: expected a list"),
        ({"grid": {"object_yaw": []}}, "grid.object_yaw: expected a list of at least one"),
        ({"grid": {}}, "grid: expected at least one of"),
        ({"grid": {"object_yaw": [0.1] * 400, "terrain_height": [1] * 400}}, "at most 100000"),
        ({"sample": {"count": 3}}, "sample.ranges"),
        ({"sample": {"count": 3, "ranges": {}}}, "sample.ranges: expected at least one of"),
        ({"sample": {"count": "many", "ranges": {"object_yaw": [0, 1]}}}, "sample.count: .*whole"),
        ({"sample": {"count": 10**9, "ranges": {"object_yaw": [0, 1]}}}, "count: .*at most 100000"),
        ({"sample": {"count": 1, "ranges": {"object_yaw": [1]}}}, "lowest, highest"),
        ({"sample": {"count": 1, "seed": -1, "ranges": {"object_yaw": [0, 1]}}}, "sample.seed"),
    ],
)
def test_bad_sources_are_refused(tmp_path, change, message):
    source = MINIMAL["sources"][0] | change
    with pytest.raises(FileFormatError, match=rf"sources\[0\].*{message}"):
        read_recipe(write(tmp_path, MINIMAL | {"sources": [source]}))


@pytest.mark.parametrize("count", [0, -1, 2.5, True, "3"])
def test_a_sample_counts(tmp_path, count):
    sample = {"count": count, "ranges": {"object_yaw": [0, 1]}}
    path = tmp_path / "recipe.yaml"
    source = {"demonstration": "box_carry", "sample": sample}
    path.write_text(yaml.safe_dump(MINIMAL | {"sources": [source]}))
    with pytest.raises(FileFormatError, match=r"sources\[0\]\.sample\.count: .*from 1 on"):
        read_recipe(path)


def test_sources_are_told_apart(tmp_path):
    for name in ("S1/walk.bvh", "S2/walk.bvh", "take [1].bvh", "map.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    sources = [
        {"demonstration": "*/walk.bvh", "options": {"skeleton": "map.yaml", "height": None}},
        {"demonstration": "S1/*.bvh", "options": {"skeleton": "lafan1"}},
        {"demonstration": str(tmp_path / "S?" / "walk.bvh")},
        {"demonstration": "take [1].bvh", "name": "first take"},
    ]
    entries = read_recipe(write(tmp_path, MINIMAL | {"sources": sources})).sources
    names = ["S1_walk", "S2_walk", None, "S1_walk", "S2_walk", "first take"]
    assert [e.name for e in entries] == names
    assert entries[0].options == {"skeleton": str(tmp_path / "map.yaml")}
    assert entries[2].options == {"skeleton": "lafan1"}
    (tmp_path / "links").mkdir()
    (tmp_path / "links/one.bvh").symlink_to(tmp_path / "S1/walk.bvh")
    (tmp_path / "links/walk.bvh").symlink_to(tmp_path / "S1/walk.bvh")
    linked = [{"demonstration": "links/*.bvh"}, {"demonstration": "links/one.bvh"}]
    entries = read_recipe(write(tmp_path, MINIMAL | {"sources": linked})).sources
    assert [e.name for e in entries] == ["one", None, "one"]
    assert {e.demonstration for e in entries} == {str(tmp_path / "S1/walk.bvh")}
    several = {"demonstration": "*/walk.bvh", "name": "one"}
    with pytest.raises(FileFormatError, match="name: expected given for a single file"):
        read_recipe(write(tmp_path, MINIMAL | {"sources": [several]}))


def test_missing_recipe(tmp_path):
    with pytest.raises(FileFormatError, match="existing"):
        read_recipe(tmp_path / "none.yaml")


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=6),
    lambda x: st.lists(x, max_size=3) | st.dictionaries(st.text(max_size=6), x, max_size=3),
    max_leaves=8,
)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(
    st.dictionaries(st.sampled_from(["robots", "sources", "fps", "x"]), JSON, max_size=4),
    st.dictionaries(
        st.sampled_from(["variations", "grid", "sample", "options", "robots"]), JSON, max_size=3
    ),
)
def test_any_content_is_read_or_refused(tmp_path_factory, top, source):
    path = tmp_path_factory.mktemp("fuzz") / "recipe.yaml"
    sources = [{"demonstration": "box_carry"} | source]
    for data in (top, MINIMAL | {"sources": sources}):
        path.write_text(yaml.safe_dump(data))
        try:
            recipe = read_recipe(path)
        except FileFormatError:
            continue
        assert all(np.isfinite(v.object_yaw) for e in recipe.sources for v in e.variations)
