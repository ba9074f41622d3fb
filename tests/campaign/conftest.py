"""One small fabricated campaign, evaluated once for all tests that only look at it."""

import pytest

from frictionlab.campaign import Campaign, evaluate
from frictionlab.campaign.trials import trial_of
from frictionlab.scene import Scene, scene_from_tables
from tests.campaign.fabricate import SCENE, small_campaign


@pytest.fixture(scope="session")
def scene() -> Scene:
    return scene_from_tables(SCENE)


@pytest.fixture(scope="session")
def campaign(scene: Scene) -> Campaign:
    return evaluate([trial_of(row) for row in small_campaign()], scene)
