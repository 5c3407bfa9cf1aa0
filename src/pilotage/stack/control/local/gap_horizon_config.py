"""What `gap-horizon` draws and prices, and what it keeps away from besides."""

from __future__ import annotations

from pydantic import Field

from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.sampled_plans import SampledPlansConfig

Share = Field(default=0.65, gt=0.0, le=1.0)


class GapHorizonConfig(SampledPlansConfig):
    """The same for few plans that are checked besides, and its manners among people and in narrow places."""

    horizon_s: Positive = 1.0
    far_horizon_s: Positive = 1.6
    """The same close to the goal, with a moving body in sight, or a place ahead that only an outline that
    stands straight gets through: it has to be lined up for early. Elsewhere as many samples of a shorter plan
    find a better one."""
    rollouts: int = Field(default=192, ge=8, le=20000)
    resample_steps: int = Field(default=2, ge=1, le=100)
    """New samples are drawn every so many steps; between them the last plan goes on, checked as ever."""
    turn_std_rad_s: Positive = 1.0
    temperature_s: Positive = 0.05
    margin_m: NonNegative = 0.015
    margin_s: NonNegative = 0.025
    """Between footprint and obstacle points, in plans: at rest, and more per m/s."""
    least_margin_m: NonNegative = 0.01
    least_margin_s: NonNegative = 0.015
    """The same in the last check of a command."""
    passage_margin_m: NonNegative = 0.004
    """The same in a gap that is driven straight and slowly, its axis measured again and again."""
    squeezed_m_s: Positive = 0.35
    """With an obstacle point nearer than ``least_margin_m`` it drives no faster: which side is nearer than
    believed the next readings tell."""
    brake_trust: float = Share
    """Share of the data sheet's braking and turning that is relied on."""
    people_margin_m: NonNegative = 0.05
    """To where a moving body is foretold, in a command's last check: the robot brings itself no nearer."""
    people_std: NonNegative = 1.5
    """By so many standard deviations of the foretold place it may be nearer."""
    people_hold_s: NonNegative = 0.3
    """Near people a command that speeds up has to be good for so long before the braking begins."""
    calm_m: NonNegative = 2.5
    calm_m_s: Positive = 1.4
    calm_rad_s: Positive = 2.0
    """With a moving body so near ahead it drives no faster: behind one there may be another, whom nobody
    sees. With one so near anywhere it turns no faster: corners that swing do not stop at once."""
    walk_m_s: NonNegative = 1.5
    heed_s: NonNegative = 1.0
    """Who comes faster than people walk is heeded from as much farther as he gains on a walker in this time:
    from walk to sprint is half a second."""
    new_m: NonNegative = 5.0
    """Nor does it drive faster while somebody is so near ahead of whom it cannot tell yet where he goes: he
    may run."""
    backs_after_s: NonNegative = 10.0
    """For so long after it saw somebody it does not back where its laser does not look, unless it has come
    nowhere for as long: it may be shut in."""
    stuck_s: Positive = 2.0
    stuck_m: Positive = 0.15
    """Where it came no farther than this in that time, it tries the narrowest place ahead straight; where it
    has tried that, it closes the place and looks elsewhere."""
    close_ahead_m: Positive = 1.2
    stand_m: NonNegative = 0.1
    """A robot that does not drive does not start, nor turn, with a moving body nearer than this, ..."""
    rests_readings: int = Field(default=50, ge=1, le=1000)
    """... unless that has not moved for so many: its commands are checked all the same."""
    unsure_m: NonNegative = 1.0
    unsure_s: NonNegative = 0.5
    """Nor, for so long, with one nearer than this of which it cannot tell yet where it goes."""
    check_step_s: Positive = 0.05
