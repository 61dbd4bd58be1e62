"""The distill stage: a conditions folder and a prompt (or a reference) in, a material field out."""

import contextlib
import dataclasses
import math
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from stages.core.artifact import Provenance, peek, plain_options, run_log, save_npz, write_text
from stages.core.errors import InputError, NumericalError
from stages.core.parallel import ahead, cores
from stages.core.progress import Progress, Tell, silent, untold
from stages.core.schemas import MATERIAL
from stages.core.shading import Material, Transport, shade
from stages.distill import checkpoint, regularizers, schedule
from stages.distill.base import Base
from stages.distill.checkpoint import State, step_generator
from stages.distill.guidance.base import Budget, Guidance
from stages.distill.like import Like, read_like
from stages.distill.moves import Moves, told
from stages.distill.optimizer import RowAdam
from stages.distill.options import QUALITY, DistillOptions
from stages.distill.parts import Claim, claimed, shared
from stages.distill.preview import write_preview
from stages.distill.regions import Regions
from stages.distill.sampling import CropSampler, PixelSampler, Sample
from stages.distill.start import least_like_light
from stages.distill.views import Views
from stages.light.leaving import OwnLight
from stages.material.library import Library, hashes
from stages.material.recipe import EVEN, Recipe
from stages.material.residual import Residual, ResidualConfig, combined
from stages.prior.explain import parts
from stages.prior.sizes import LEAST, MOST

SEEN_BY = 3
"""A surface point is taken to be seen by one view in this many."""

UNLIT = 10.0
"""Weight of what varies along with the light within the coats, as a multiple of the anchor's."""

POOL = 2**32
"""In place of a step's number where a pool of pixels is chosen: no step has it."""


@dataclass(frozen=True)
class DistillResult:
    """What a run did: steps in all, of which `resumed` were found in a checkpoint; last loss; already up to date."""

    steps: int
    resumed: int
    loss: float
    up_to_date: bool


@dataclass
class Run:
    """One call of `distill`: what stays the same from step to step, and the state that does not.

    own: what the object throws on itself as the recipe has it, for a guidance that sees crops; None without bounces.
    """

    out: Path
    views: Views
    guidance: Guidance
    base: Base
    options: DistillOptions
    budget: Budget
    request: Provenance
    state: State
    clock: "Clock"
    own: list[OwnLight] | None = None

    @property
    def progress(self) -> float:
        """Share of the steps done, in [0, 1)."""
        return self.state.step / self.budget.steps


def distill(
    conditions: Path, out: Path, options: DistillOptions, force: bool = False, progress: Progress = silent, tell: Tell = untold
) -> DistillResult:
    """Learn what to add to a recipe until its renderings under all views and lights please the guidance.

    Writes `out` (material.npz), `<stem>.curve.csv` and `<stem>.preview.png` beside it, and while it runs
    `<out>.checkpoint`, from which the same call continues. Tells what is read of the prompt, and where it lies.

    Raises: InputError, ArtifactError, OutputError, NumericalError; KeyboardInterrupt after saving a checkpoint.
    """
    with torch_threads(cores() if options.guidance == "sd" else 1):
        return _distill(conditions, out, options, force, progress, tell)


def _distill(
    conditions: Path, out: Path, options: DistillOptions, force: bool, progress: Progress, tell: Tell
) -> DistillResult:
    device = chosen_device(options)
    like = None if options.like is None else read_like(options.like, options)
    options = options if like is None else dataclasses.replace(options, prompt=like.prompt)
    views = Views(conditions)
    carried = [(part.name, part.prompt) for part in like.recipe.parts] if like else []
    claims, lines = claimed(options.parts, views.parts, carried)
    guidance = make_guidance(options, views, device, claims, like)
    budget = chosen_budget(options, guidance.budget)
    request = _request(options, budget, views, guidance, claims, like)
    if not force and (done := peek(out, MATERIAL)) and done.same_request(request):
        checkpoint.checkpoint_path(out).unlink(missing_ok=True)
        return DistillResult(budget.steps, 0, math.nan, True)
    with run_log(out) as log:
        base = Base(guidance.recipe, views)
        guidance.begin(progress)
        state = new_state(options, views, device, base.recipe)
        resumed = state.step if not force and checkpoint.resume(out, state, request) else 0
        clock = Clock(state.seconds[-1] if resumed else 0.0)
        run = Run(out, views, guidance, base, options, budget, request, state, clock, own_light(views, guidance, base))
        lines += shared(claims, views.shared_labels)
        for line in [*lines, *(parts(base.recipe) if guidance.recipe != EVEN else ())]:
            tell(line)
        if not resumed:
            _preview(run)  # what the words alone give
        _all_steps(run, progress)
        _preview(run)
        _write(run)  # the last: a run that finds it has nothing more to do
        for line in told(run.base.recipe, state.moves.moved(run.base.recipe)):
            tell(line)
        log |= {"milliseconds_per_step": clock.per_step(state.step - resumed), "steps": state.step, "resumed": resumed}
    checkpoint.checkpoint_path(out).unlink(missing_ok=True)
    return DistillResult(state.step, resumed, state.loss[-1], False)


@contextlib.contextmanager
def torch_threads(count: int) -> Iterator[None]:
    """Within the block torch's operators run on so many threads each.

    On one they give the same bytes on any number of cores, and a small model's operators are hardly faster on more: torch's
    threads spin between them, which starves every other job. A large model's gain, and give the same bytes on as many cores.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def chosen_budget(options: DistillOptions, called_for: Budget) -> Budget:
    """What the guidance calls for, where the options do not say otherwise."""
    steps = options.steps or max(1, round(called_for.steps * QUALITY[options.quality]))
    return Budget(steps, options.learning_rate or called_for.learning_rate)


def make_guidance(
    options: DistillOptions, views: Views, device: torch.device, claims: Sequence[Claim] = (), like: Like | None = None
) -> Guidance:
    """The guidance that the options name.

    Args: claims: the parts that have prompts of their own. like: whose recipe it begins with.
    Raises: InputError, ArtifactError.
    """
    if options.guidance == "reference":
        if options.parts:
            raise InputError("--part with --guidance reference: it reads no words; expected --guidance prior or sd")
        from stages.distill.guidance import reference
        from stages.light.textured_model import TexturedModel

        if options.reference is None:
            raise InputError("--guidance reference: no model is given; add --reference MODEL.glb")
        asset = TexturedModel(options.reference, views.to_world)
        chosen = step_generator(options.seed, POOL)
        thrown = None if views.bounces is None else views.bounces.solved(reference.material_of(asset, views.bounces))
        pool = PixelSampler(views, reference.PIXELS * options.batch, chosen, device)
        return reference.ReferenceGuidance(asset, pool, thrown)
    if options.guidance not in ("prior", "sd"):
        raise InputError(f"--guidance {options.guidance}: unknown; expected prior, sd or reference")
    if not options.prompt.strip():
        raise InputError("--prompt: empty; say what the object is made of, such as \"weathered bronze\"")
    if options.object_size is not None and not LEAST <= options.object_size <= MOST:
        raise InputError(f"--object-size {options.object_size:g}: expected {LEAST:g} to {MOST:g} metres")
    if options.guidance == "sd":
        return _stable_diffusion(options, views, device, claims)
    from stages.distill.guidance import prior
    from stages.prior.model import load_prior
    from stages.prior.prompt import read_parts, read_prompt

    model = load_prior(device)
    sampler = CropSampler(views, model.size, options.batch, device, options.score.lights)

    library = Library(options.library) if options.library else None
    if like is None:
        recipe = read_prompt(options.prompt, model, options.seed, options.object_size, library)
    else:
        recipe = like.carried(views.extent(), options.object_size)
    own = (*recipe.parts, *read_parts(options.parts, recipe, model, options.seed, library))
    recipe = replace(recipe, parts=tuple(replace(own[claim.number], labels=claim.labels) for claim in claims))
    scans = library.used({coat.look for coat in recipe.coats}) if library else {}

    def begin() -> Recipe:
        return recipe if like is not None else least_like_light(recipe, views, step_generator(options.seed, POOL))

    guidance = prior.PriorGuidance(model, sampler, options, begin, Regions(claims))
    if scans:
        guidance.identity = guidance.identity | {"library": scans}
        guidance.inputs |= hashes(scans)
    return guidance


def _stable_diffusion(options: DistillOptions, views: Views, device: torch.device, claims: Sequence[Claim]) -> Guidance:
    from stages.distill.guidance import sd
    from stages.sd import files, memory, models

    found = files.find_models(options.sd)
    sampler = CropSampler(views, sd.view_size(views, found), options.batch, device, options.score.lights)
    model = models.load_models(found, device, memory.plan(options.sd.vram, device))
    return sd.StableDiffusionGuidance(model, sampler, options, Regions(claims))


def new_state(options: DistillOptions, views: Views, device: torch.device, recipe: Recipe) -> State:
    """What is learnt, and optimiser, before the first step; the finest cells are as far apart as the surface points that all
    views see."""
    spacing = views.pixel_size() / math.sqrt(max(1.0, len(views.seen) / SEEN_BY))
    residual = Residual(ResidualConfig.for_detail(spacing), torch.Generator().manual_seed(options.seed)).to(device)
    moves = Moves(recipe).to(device)
    parameters = {**dict(residual.named_parameters()), **dict(moves.named_parameters())}
    return State(residual, moves, RowAdam(parameters, tables=frozenset({"table", "offsets"})))


def own_light(views: Views, guidance: Guidance, base: Base) -> list[OwnLight] | None:
    """What the object throws on itself where it is made as the recipe says; None without bounces.

    What is learnt is held near to the recipe and adds little to it. A guidance of loose pixels knows better: its pool has it.
    """
    if views.bounces is None or not isinstance(guidance.sampler, CropSampler):
        return None
    cells = views.bounces
    return cells.solved(base.at(cells.points, cells.normals, cells.footprint, cells.label)[0])


def _all_steps(run: Run, progress: Progress) -> None:
    """Do the steps that are left, with a checkpoint now and then and when interrupted."""
    state, saved = run.state, time.perf_counter()
    with checkpoint.interruptions() as interrupted:
        try:
            for shown in ahead(lambda step: draw(run, step), range(state.step, run.budget.steps)):
                loss = optimisation_step(run, shown)
                state.loss.append(loss)
                state.seconds.append(run.clock.elapsed())
                progress(f"distill (loss {loss:.4f})", state.step, run.budget.steps)
                if interrupted():
                    raise KeyboardInterrupt
                if time.perf_counter() - saved > checkpoint.SECONDS:
                    checkpoint.save(run.out, state, run.request)
                    _preview(run)
                    saved = time.perf_counter()
        except KeyboardInterrupt:
            checkpoint.save(run.out, state, run.request)
            raise


@dataclass(frozen=True)
class Shown:
    """What a step shows: a sample, its transport with what the object throws on itself, the recipe's material of its points
    (P, 5), how much of each is each coat's (P, K), and the generator that draws the rest."""

    sample: Sample
    transport: Transport
    base: Tensor
    shares: Tensor
    generator: torch.Generator


def draw(run: Run, step: int) -> Shown:
    """What a step shows. Nothing that is learnt enters: it is found while the step before is done."""
    generator = step_generator(run.options.seed, step)
    with run.clock("data"):
        sample = run.guidance.draw(generator)
        run.guidance.sampler.prefetch(step_generator(run.options.seed, step + 1))
        transport = sample.transport
        if run.own is not None and isinstance(run.guidance.sampler, CropSampler):
            transport = run.guidance.sampler.with_own_light(run.own, sample)
    with run.clock("recipe"):
        base, shares = run.base.of(sample)
    return Shown(sample, transport, base, shares, generator)


def optimisation_step(run: Run, shown: Shown) -> float:
    """One step: shade, ask the guidance, update. Returns: the guidance's number for the curve."""
    state, options, clock = run.state, run.options, run.clock
    sample, base, generator = shown.sample, shown.base, shown.generator
    with clock("residual"):
        learnt, nearby = _residuals(state.residual, sample, options, generator)
        moved = state.moves(base, shown.shares) if run.guidance.held else torch.zeros_like(learnt)
        material = Material.of(combined(base, learnt + moved))
    with clock("shading"):
        seen = shade(shown.transport, material) if run.guidance.looks else material.columns()
    with clock("guidance"):
        response = run.guidance.respond(seen.detach(), sample, run.progress, generator)
    if not (math.isfinite(response.loss) and bool(torch.isfinite(response.gradient).all())):
        raise NumericalError(_not_finite(state.step, sample, run.views, options.seed))
    with clock("backward"):
        steady = Material.of(combined(base, learnt + moved.detach()))
        losses = _regularizers(Learnt(material, steady, shown.shares, learnt, nearby), sample, run)
        pull(seen, response.gradient, losses)
    with clock("optimiser"):
        state.optimizer.step(run.budget.learning_rate * schedule.learning_rate(run.progress))
    return response.loss


def pull(values: Tensor, gradient: Tensor, losses: list[Tensor]) -> None:
    """Bring the gradient by some values, and those of losses, to the parameters behind them.

    As one number: gradients that are given as tensors make torch load its symbolic algebra, which takes a second.
    """
    sum(losses, (values * gradient).sum()).backward()


def _residuals(
    residual: Residual, sample: Sample, options: DistillOptions, generator: torch.Generator
) -> tuple[Tensor, Tensor | None]:
    """What was learnt at a sample's points, (P, 5), and, for the smoothness loss, near them."""
    if options.hold.smoothness == 0:
        return residual(sample.points), None
    moved = regularizers.displaced(sample.points, sample.normals, generator)
    here, nearby = residual(torch.cat([sample.points, moved])).chunk(2)
    return here, nearby


@dataclass(frozen=True)
class Learnt:
    """Of a sample's points: their material, the same as the residual alone may change it, the coats' shares (P, K), the
    residual's logits (P, 5), and those nearby."""

    material: Material
    steady: Material
    shares: Tensor
    residual: Tensor
    nearby: Tensor | None


def _regularizers(learnt: Learnt, sample: Sample, run: Run) -> list[Tensor]:
    """The weighted losses on the material itself."""
    hold = run.options.hold
    losses = []
    if run.guidance.held:  # words decide what a picture leaves open; a known target needs no such help
        metallic = learnt.material.metallic
        losses.append(hold.bimodal * schedule.bimodal(run.progress) * regularizers.bimodality(metallic))
        losses.append(hold.anchor * regularizers.hold(learnt.residual))
        losses.append(hold.anchor * regularizers.SLOPE**2 * run.state.moves.hold())
        even = run.state.moves.even(learnt.shares)
        losses.append(hold.anchor * UNLIT * regularizers.baked_light(learnt.steady, even, sample.transport.E))
    if learnt.nearby is not None:
        losses.append(hold.smoothness * regularizers.smoothness(learnt.residual, learnt.nearby))
    return losses


class Clock:
    """Seconds by part of a step, and in all, counted on from an interrupted run."""

    def __init__(self, before: float = 0.0) -> None:
        self._start = time.perf_counter() - before
        self._parts: dict[str, float] = defaultdict(float)

    @contextlib.contextmanager
    def __call__(self, part: str) -> Iterator[None]:
        """Count the block's time towards a part."""
        start = time.perf_counter()
        yield
        self._parts[part] += time.perf_counter() - start

    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._start

    def per_step(self, steps: int) -> dict[str, float]:
        """Milliseconds of each part, mean over the steps that were done here."""
        return {part: round(1000 * seconds / max(steps, 1), 3) for part, seconds in self._parts.items()}


def _not_finite(step: int, sample: Sample, views: Views, seed: int) -> str:
    where = ", ".join(f"view {v} under {views.environments[e]}" for v, e in sample.source) or "pixels of all views"
    return f"step {step}: the gradient is not finite ({where}, seed {seed}); try a smaller --learning-rate"


def chosen_device(options: DistillOptions) -> torch.device:
    """The torch device asked for, if it works. Raises: InputError."""
    if (options.steps is not None and options.steps < 1) or options.batch < 1:
        raise InputError(f"--steps {options.steps} --batch {options.batch}: expected 1 or more")
    try:
        device = torch.device(options.device)
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError) as error:
        cause = str(error).splitlines()[0][:100]
        raise InputError(f"--device {options.device}: cannot be used ({cause}); expected cpu or cuda") from error
    return device


def _request(
    options: DistillOptions, budget: Budget, views: Views, guidance: Guidance, claims: list[Claim], like: Like | None
) -> Provenance:
    chosen = plain_options(options) | dataclasses.asdict(budget)
    if guidance.weights:
        chosen |= plain_options(guidance.weights)
    chosen["reference"] = options.reference.name if options.reference else None
    for known in ("sd", "quality", "library", "like"):  # by the hashes of their files, or by the steps
        del chosen[known]
    inputs = {"conditions": views.digest, "prep": views.prep, **guidance.inputs}
    inputs |= {} if like is None else {"like": like.digest}
    parts = [{"name": claim.name, "prompt": claim.prompt} for claim in claims]
    extra = {"prompt": options.prompt, "parts": parts, "guidance": guidance.identity, "environments": views.environments}
    return Provenance(chosen, options.seed, inputs, extra)


def _beside(out: Path, ending: str) -> Path:
    return out.with_name(f"{out.stem}.{ending}")


def _preview(run: Run) -> None:
    write_preview(_beside(run.out, "preview.png"), run.views, run.base.moved(run.state.moves), run.state.residual)


def _write(run: Run) -> None:
    """Write the curve, then material.npz."""
    state, views, request = run.state, run.views, run.request
    lines = [f"{i},{t:.3f},{loss:.6g}" for i, (t, loss) in enumerate(zip(state.seconds, state.loss, strict=True), 1)]
    write_text(_beside(run.out, "curve.csv"), "step,seconds,loss\n" + "\n".join(lines) + "\n")
    arrays = {
        **run.base.survey.survey.to_arrays(),
        **state.residual.to_arrays(),
        "curve_step": np.arange(1, state.step + 1, dtype=np.int32),
        "curve_loss": np.array(state.loss, np.float32),
        "c2w": views.c2w,
        "fov_y": views.fov_y,
        "size": np.array([views.width, views.height], np.int32),
    }
    extra = {**request.extra, "recipe": state.moves.moved(run.base.recipe).to_json(), "residual": state.residual.config_dict()}
    extra["extent"] = views.extent()
    if views.bounces is not None:
        extra["bounces"] = views.bounces.count
    save_npz(run.out, MATERIAL, arrays, Provenance(request.options, request.seed, request.inputs, extra))
