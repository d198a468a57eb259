"""Train a policy to keep station, with PPO in PyTorch alone, on rows of a batch.

In a clone: `pip install torch .` and `python examples/train_on_rows.py`; with a card of NVIDIA's, `pip install torch
'.[cuda]'` and `python examples/train_on_rows.py cuda 16384`: then nothing but messages leaves the card.
"""

import sys

import torch

import vrx_mj

WORLD = {
    "extends": "ocean",
    "sea": {"model": "pms", "number": 3, "scale": 1.5, "gain": 0.2, "period": 5, "angle": 0.4, "tau": 0},
    "wind": {"var_gain": 0.5, "var_time": 5, "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
}
HOLD, HORIZON, EPISODE = 0.4, 16, 150
"""Duration of a decision [s]; decisions of an update; decisions for which a goal stands, 60 s."""
DISCOUNT, TRACE, CLIP, RATE = 0.98, 0.95, 0.2, 2e-3


class Boats:
    """Boats that keep station. Every 60 s a row has another goal, within 10 m of its boat: none needs a reset."""

    def __init__(self, rows: int, device: str) -> None:
        world = vrx_mj.compile_world(WORLD, fleet={"thrusters": "X", "engines": "fixed", "sensors": "none"})
        if device == "cpu":
            self.batch = vrx_mj.Batch(world, rows, engine="free")
        else:
            from vrx_mj import cuda

            self.batch = cuda.Batch(world, rows, stream=torch.cuda.current_stream().cuda_stream)
        waves, wind, direction = torch.rand(3, rows).double()
        self.batch.vary(waves=waves, wind_speed=6 * wind, wind_direction=2 * torch.pi * direction)
        self.batch.reset(seed=1)
        self.state = torch.as_tensor(self.batch.features, device=device)[:, 0]  # the batch's own memory
        self.device, self.goal = device, torch.zeros(rows, 3, device=device)
        self.age = torch.randint(EPISODE, (rows,), device=device)

    def begin(self, who: torch.Tensor) -> None:
        """Draw goals, evenly over the disc, and headings."""
        share, bearing, heading = torch.rand(3, len(who), device=self.device)
        way = torch.polar(10 * share.sqrt(), 2 * torch.pi * bearing)
        x, y = self.state[:, 0] + way.real, self.state[:, 1] + way.imag
        self.goal = torch.where(who[:, None], torch.stack((x, y, 2 * torch.pi * heading), 1), self.goal)

    def observe(self) -> tuple[torch.Tensor, torch.Tensor]:
        """What boats see, (rows, 7), and VRX's errors of their poses [m], (rows,)."""
        x, y, _, w, i, j, k, u, v, _, _, _, r = self.state.unbind(1)
        yaw = torch.atan2(2 * (i * j + w * k), 1 - 2 * (j * j + k * k))
        east, north, turn = self.goal[:, 0] - x, self.goal[:, 1] - y, self.goal[:, 2] - yaw
        ahead, port = yaw.cos() * east + yaw.sin() * north, yaw.cos() * north - yaw.sin() * east
        away, angle = torch.hypot(ahead, port), torch.atan2(turn.sin(), turn.cos())
        seen = torch.stack((ahead.asinh(), port.asinh(), angle.sin(), angle.cos(), u, v, 2 * r), 1)
        return seen.float(), (away + 0.75**away * angle.abs()).float()

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Hold shares of full power of the four engines, which are not turned, for 0.4 s; what `observe` returns."""
        self.batch.step(torch.nn.functional.pad(actions.clamp(-1, 1).double(), (0, 4)), duration=HOLD)
        self.age += 1
        return self.observe()


def network(outputs: int) -> torch.nn.Sequential:
    """Two layers of 64; nearly 0 at first."""
    last = torch.nn.Linear(64, outputs)
    torch.nn.init.orthogonal_(last.weight, 0.01)
    return torch.nn.Sequential(torch.nn.Linear(7, 64), torch.nn.Tanh(), torch.nn.Linear(64, 64), torch.nn.Tanh(), last)


@torch.no_grad()
def mean_error(boats: Boats, policy: torch.nn.Module) -> float:
    """VRX's score: the mean error of the pose over 60 s from new goals, here over all rows, too [m]."""
    boats.begin(boats.age >= 0)
    return sum(boats.step(policy(boats.observe()[0]))[1].mean().item() for _ in range(EPISODE)) / EPISODE


def main(device: str = "cpu", rows: int = 256, updates: int = 200) -> tuple[float, float]:
    """Train, and return the mean error [m] before and after."""
    torch.manual_seed(1)
    boats, policy, value = Boats(rows, device), network(4).to(device), network(1).to(device)
    spread = torch.full((4,), -0.7, device=device, requires_grad=True)
    optimizer = torch.optim.Adam([*policy.parameters(), *value.parameters(), spread], RATE)
    before = mean_error(boats, policy)
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = RATE * (1 - update / updates)
        kept = []
        with torch.no_grad():
            for _ in range(HORIZON):
                seen, _ = boats.observe()
                chosen = torch.distributions.Normal(policy(seen), spread.exp())
                action = chosen.sample()
                after, error = boats.step(action)
                cut, worth, chance = boats.age % EPISODE == 0, value(seen), chosen.log_prob(action).sum(1, True)
                gain = DISCOUNT * value(after) - worth - 0.3 * error.sqrt()[:, None]
                kept.append([seen, action, chance, gain, worth, ~cut[:, None]])
                boats.begin(cut)
            for early, late in zip(kept[-2::-1], kept[:0:-1], strict=True):  # Schulman et al., 2016, eq. 16
                early[3] += DISCOUNT * TRACE * early[5] * late[3]
            whole = [torch.cat(parts) for parts in zip(*kept, strict=True)]
        for part in (part for _ in range(4) for part in torch.randperm(len(whole[0]), device=device).chunk(4)):
            seen, action, chance, gain, worth, _ = (each[part] for each in whole)
            logarithm = torch.distributions.Normal(policy(seen), spread.exp()).log_prob(action).sum(1, True)
            ratio, relative = (logarithm - chance).exp(), (gain - gain.mean()) / gain.std()
            better = torch.minimum(ratio * relative, ratio.clamp(1 - CLIP, 1 + CLIP) * relative).mean()
            loss = (value(seen) - worth - gain).square().mean() - better
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
        if update % 20 == 19:
            print(f"update {update + 1:3}: error {error.mean():.2f} m", flush=True)
    after = mean_error(boats, policy)
    print(f"mean error over 60 s: {before:.2f} m before, {after:.2f} m after")
    return before, after


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:]))
