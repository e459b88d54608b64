import shutil
import time
import urllib.request

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration
from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.references import Reference, cached_reference
from omni_envs.robots import G1
from omni_envs.viewer import ReferencePage

viser = pytest.importorskip("viser", reason="the viewer extra is not installed")


@pytest.fixture(scope="module")
def reference() -> Reference:
    return cached_reference(builtin_demonstration("box_carry"), G1)


@pytest.fixture
def page(reference):
    page = ReferencePage(reference, port=0)
    yield page
    page.close()


def test_scene_follows_the_frame(page, reference):
    for frame in (0, 200):
        page.show(frame)
        assert page.frame == frame
        wrist = reference.body_names.index("left_wrist_yaw_link")
        handle = page._bodies["left_wrist_yaw_link"]
        np.testing.assert_allclose(handle.position, reference.body_positions[frame, wrist])
        np.testing.assert_allclose(handle.wxyz, reference.body_quaternions[frame, wrist])
        np.testing.assert_allclose(page._object.position, reference.object_poses[frame, :3])
        human = np.asarray(page._human.points)
        np.testing.assert_allclose(human, reference.source.keypoints[frame], atol=1e-6)
        assert f"t = {frame / 50:.2f} s" in page._figures.content


def test_time_goes_on_only_while_it_plays(page, reference):
    page.advance(1.0)
    assert page.frame == 0 and not page.playing
    page._playing = True
    page.advance(1.0)
    assert page.frame == 50
    page._speed.value = "0.5×"
    page.advance(1.0)
    assert page.frame == 75
    page.advance(2.0 * reference.duration)  # round the end
    assert page.frame < reference.num_frames


def test_contacts_are_marked_where_the_human_touches(page, reference):
    held = int(np.flatnonzero(reference.contacts["left_hand"])[50])
    page.show(held)
    hand = reference.body_positions[held, reference.body_names.index("left_wrist_yaw_link")]
    marks = np.array([h.position for h in page._touch])
    assert np.linalg.norm(marks - hand, axis=1).min() < 0.3
    page.show(0)
    assert not reference.contacts["left_hand"][0]
    assert (np.array([h.position for h in page._touch])[:, 2] < -50).all()
    assert all(h.position[2] < -50 for h in page._alarm)  # a clean reference has no violation


def test_page_is_served_and_a_bad_address_refused(page, reference):
    with urllib.request.urlopen(page.url, timeout=10) as answer:
        assert b"<html" in answer.read().lower()
    with pytest.raises(OmniEnvsError, match="cannot be listened on"):
        ReferencePage(reference, host="203.0.113.1", port=8080)
    for port in (-1, 65536):
        with pytest.raises(InvalidOptionError, match="port: expected 0"):
            ReferencePage(reference, port=port)
    taken = int(page.url.rsplit(":", 1)[1])
    second = ReferencePage(reference, port=taken)
    assert second.url != page.url
    second.close()


@pytest.fixture
def browser():
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    binary, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not binary or not driver:
        pytest.skip("no chromium and chromedriver on the path")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for flag in (
        "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", "--window-size=1280,900",
    ):  # fmt: skip
        options.add_argument(flag)
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    browser.set_page_load_timeout(60)
    yield browser
    browser.quit()


def wait(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.1)
    return found


def test_in_a_real_browser(page, browser):
    from selenium.webdriver.common.by import By

    browser.get(page.url)
    client = next(iter(wait(page.server.get_clients).values()))
    body = browser.find_element(By.TAG_NAME, "body")
    wait(lambda: "box_carry → Unitree G1" in body.text and "t = 0.00 s" in body.text)
    first = client.get_render(240, 320, timeout=60)
    assert first.shape[:2] == (240, 320) and first.std() > 5  # something is drawn
    page.show(300)
    wait(lambda: "t = 6.00 s" in body.text)
    later = client.get_render(240, 320, timeout=60)
    assert np.abs(later.astype(int) - first).max() > 50
    button = next(b for b in browser.find_elements(By.TAG_NAME, "button") if b.text == "Play")
    button.click()
    wait(lambda: page.playing)
    page.advance(0.2)
    assert page.frame == 310
    wait(lambda: "t = 6.20 s" in body.text and "Pause" in body.text)
    errors = [e["message"] for e in browser.get_log("browser") if e["level"] == "SEVERE"]
    assert not [e for e in errors if "favicon" not in e]
