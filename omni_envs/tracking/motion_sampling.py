"""Where episodes start: anywhere in a motion, at its start, or where episodes fail."""

from __future__ import annotations

import numpy as np

from omni_envs.tracking import kernels
from omni_envs.tracking.config import ResetConfig
from omni_envs.tracking.motion import MotionLibrary

BIN_FRAMES = 50
"""Adaptive sampling has ⌊T / 50⌋ + 1 bins per motion: about one per second at 50 Hz."""


class MotionSampler:
    """Draws start frames.

    Adaptive sampling (BeyondMimic): every motion is cut into bins. A bin's failure average moves by
    ``ema ← decay · ema + (1 - decay) · failures`` every control step; only terminations count, in
    the bin of the frame where the episode failed. A bin is drawn with probability
    ∝ Σ_i kernel_decay^i · (ema + uniform / bins) over itself and the next bins, then a frame inside
    it.

    Args:
        library: The motions.
        config: How to draw.
    """

    def __init__(self, library: MotionLibrary, config: ResetConfig) -> None:
        self.config = config
        # An episode needs one more frame after its first to track.
        self._last_start = library.lengths - 2
        counts = library.lengths // BIN_FRAMES + 1
        self.bin_motion = np.repeat(np.arange(library.num_motions), counts)
        within = np.concatenate([np.arange(c) for c in counts])
        length, count = library.lengths[self.bin_motion], counts[self.bin_motion]
        # Bin edges as shares of the motion's frames, so that all bins of a motion are equally long.
        low, width = within * (length - 1) / count, (length - 1) / count
        self._first_bin = np.concatenate([[0], np.cumsum(counts)[:-1]])
        self._bins_per_frame = counts / (library.lengths - 1)
        self._counts = counts
        # Stretches of motion to draw from: motion, first frame, frames.
        self._cells: tuple[np.ndarray, ...] = (self.bin_motion, low, width)
        motions = np.arange(library.num_motions)
        nothing = np.zeros(len(motions))
        if not self.adapts:
            frames = 0 if config.start == "start" else library.lengths - 1
            self._cells = (motions, nothing, nothing + frames)
        if config.start_share:
            first = (motions, nothing, nothing)
            self._cells = tuple(map(np.concatenate, zip(self._cells, first, strict=True)))
        self.reset()

    def reset(self) -> None:
        """Forgets all failures."""
        self.restore(np.zeros(len(self.bin_motion)))

    def restore(self, failures: np.ndarray) -> None:
        """Goes on from the (bins,) failure averages of another sampler of these motions."""
        self.failures = failures
        self._cumulative: np.ndarray | None = None

    @property
    def adapts(self) -> bool:
        """Whether failures count."""
        return self.config.start == "adaptive"

    @property
    def num_bins(self) -> int:
        """Bins of all motions together."""
        return len(self.bin_motion)

    def record(self, motion: np.ndarray, frame: np.ndarray) -> None:
        """Moves the averages on by one control step.

        Args:
            motion: (K,) motions of the episodes that were terminated in this step.
            frame: (K,) frames within the motions where that happened.
        """
        if not self.adapts:
            return
        self.failures *= self.config.adaptive.decay
        self._cumulative = None
        if len(motion):
            within = (frame * self._bins_per_frame[motion]).astype(int)
            bins = self._first_bin[motion] + np.minimum(within, self._counts[motion] - 1)
            np.add.at(self.failures, bins, 1.0 - self.config.adaptive.decay)

    def probabilities(self) -> np.ndarray:
        """Returns (bins,) the probability of each bin."""
        adaptive = self.config.adaptive
        weight = self.failures + adaptive.uniform / self.num_bins
        # A failure has its cause before it: a bin also sees the failures of the next bins of its
        # motion, the last bin standing for those after it.
        last = (self._first_bin + self._counts - 1)[self.bin_motion]
        place = np.arange(self.num_bins)
        spread = np.zeros(self.num_bins)
        for i in range(adaptive.kernel):
            spread += adaptive.kernel_decay**i * weight[np.minimum(place + i, last)]
        return spread / spread.sum()

    def metrics(self) -> dict[str, float]:
        """Returns normalised entropy, probability and index of the likeliest bin."""
        p = self.probabilities()
        entropy = -(p * np.log(p + 1e-12)).sum() / max(np.log(len(p)), 1e-12)
        top = int(p.argmax())
        return {"entropy": float(entropy), "top_probability": float(p[top]), "top_bin": float(top)}

    def draw(self, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Draws start frames.

        Args:
            draws: (2, K) uniform in [0, 1).

        Returns:
            (K,) motions and (K,) frames within them, at most the last but one.
        """
        if self._cumulative is None:
            shares, first = self._shares(), self.config.start_share
            if first:
                motions = len(self._last_start)
                shares = np.append((1.0 - first) * shares, np.full(motions, first / motions))
            self._cumulative = np.cumsum(shares)
        motion, frame = np.empty(draws.shape, int)
        kernels.draw_frames(self._cumulative, *self._cells, self._last_start, draws, motion, frame)
        return motion, frame

    def _shares(self) -> np.ndarray:
        """How likely the stretches of motion are that start frames are drawn from."""
        if self.adapts:
            return self.probabilities()
        if self.config.start == "start":
            return np.full(len(self._last_start), 1.0 / len(self._last_start))
        # Uniform over all start frames of all motions: long motions are drawn more often.
        return (self._last_start + 1) / (self._last_start + 1).sum()
