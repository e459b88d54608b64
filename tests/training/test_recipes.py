from dataclasses import replace

import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.tracking import make_config
from omni_envs.training.config import PPOConfig, TrainConfig, merged
from omni_envs.training.evaluate import evaluation_options
from omni_envs.training.recipes import RECIPES


@pytest.mark.parametrize("name", RECIPES)
def test_options_are_valid_and_saved_whole(name, tmp_path):
    recipe = RECIPES[name]
    config = recipe.config("X", tmp_path, 1)
    config.save()
    assert TrainConfig.load(tmp_path) == config
    assert make_config(**merged(config.env_options, config.training_options)).observation.privileged


def test_the_published_recipe_is_the_published_one():
    assert RECIPES["published"].ppo == PPOConfig()
    assert make_config(**RECIPES["published"].env_options) == make_config()


def test_what_is_easier_in_training_is_not_so_in_the_evaluation():
    evaluated = make_config(**evaluation_options(RECIPES["quick"].env_options))
    paper = make_config()
    assert replace(evaluated.randomization, seed=0) == paper.randomization
    assert evaluated.observation.noise == paper.observation.noise
    assert evaluated.reset.noise == paper.reset.noise
    assert evaluated.physics == paper.physics


def test_everything_can_be_overridden(tmp_path):
    config = RECIPES["small"].config(
        "X",
        tmp_path,
        5,
        num_envs=7,
        env_options={"action": {"scale": 1.5}},
        ppo={"epochs": 1},
        seed=3,
    )
    assert config.num_envs == 7 and config.seed == 3 and config.ppo.epochs == 1
    assert config.env_options == {"action": {"mode": "feedforward", "scale": 1.5}}
    assert config.ppo.hidden == RECIPES["small"].ppo.hidden
    with pytest.raises(InvalidOptionError, match="unknown"):
        RECIPES["small"].config("X", tmp_path, 5, sed=3)


def test_what_grows_in_training_is_whole_in_the_evaluation():
    recipe = RECIPES["small"]
    trained = make_config(**merged(recipe.env_options, recipe.training_options))
    evaluated = make_config(**evaluation_options(recipe.env_options))
    assert trained.reset.growth is not None and evaluated.reset.growth is None
    assert trained.reset.noise == evaluated.reset.noise == make_config().reset.noise
    whole = make_config().randomization
    assert replace(trained.randomization, variants=whole.variants) == whole
    assert whole == replace(evaluated.randomization, seed=0)


def test_a_policy_may_lose_its_object_less_far_in_training_than_in_the_evaluation():
    recipe, task = RECIPES["small"], make_config().termination
    trained = make_config(**merged(recipe.env_options, recipe.training_options)).termination
    evaluated = make_config(**evaluation_options(recipe.env_options)).termination
    assert trained.object_position < task.object_position == evaluated.object_position
    assert trained.object_after == 0.0 and trained.object_angle == task.object_angle
