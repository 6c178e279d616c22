"""Light and water: bright above, dark below, and nothing that is dear to draw without a graphics card."""

from __future__ import annotations

import numpy as np
import viser

from farhand.local_site.view.scene import palette


def add_water(scene: viser.SceneApi) -> None:
    """Set the scene's background and lights."""
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(hdri=None)
    below = np.linspace(0.0, 1.0, 256)[:, None, None]
    water = (1.0 - below) * palette.WATER_ABOVE + below * palette.WATER
    scene.set_background_image(np.broadcast_to(water, (256, 8, 3)).astype(np.uint8), format="png")
    scene.add_light_ambient("/light/ambient", intensity=0.8)
    scene.add_light_hemisphere(
        "/light/surface", sky_color=(205, 238, 255), ground_color=(20, 45, 55), intensity=1.3
    )
    scene.add_light_directional("/light/key", intensity=2.2, position=(-2.5, -2.0, 4.0))
    scene.add_light_directional("/light/fill", intensity=0.8, position=(-2.0, 3.0, 1.0))
