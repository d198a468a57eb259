"""Train a policy to keep station, with PPO in PyTorch alone, on rows of an environment.

In a clone: `pip install torch '.[rl]'` and `python examples/train_on_rows.py`; with a card of NVIDIA's, `pip install
torch '.[rl,cuda]'` and `python examples/train_on_rows.py cuda 16384`: then nothing but messages leaves the card.
"""

import sys

import gymnasium
import torch

FLEET = {"thrusters": "X", "engines": "fixed", "sensors": "none"}
HOLD, HORIZON, EPISODE = 4, 16, 150
"""Steps of a decision, 0.4 s; decisions of an update, and of an episode, 60 s, in the last step of which one begins."""
DISCOUNT, TRACE, CLIP, RATE = 0.98, 0.95, 0.2, 2e-3


class Boats:
    """Rows of the environment, with decisions of 0.4 s, shares of full power of the four engines, which do not turn."""

    def __init__(self, rows: int, device: str) -> None:
        where = {"device": device} if device == "cuda" else {"engine": "free"}
        self.device = device
        self.rows = gymnasium.make_vec(
            "vrx_mj.rl:vrx_mj/StationKeeping-v0", num_envs=rows, fleet=FLEET, max_episode_steps=HOLD * EPISODE - 1,
            waves=(0, 1), wind_speed=(0, 6), **where,
        )  # fmt: skip
        self.features = len(self.rows.unwrapped.observation_names)
        self.seen = self.begin(seed=1)

    def tensor(self, array: object) -> torch.Tensor:
        """An array of the environment's as a tensor of the same memory."""
        return torch.as_tensor(array, device=self.device)

    def begin(self, seed: int | None = None) -> torch.Tensor:
        """Begin an episode in every row."""
        return self.tensor(self.rows.reset(seed=seed)[0])

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """What boats see at the end, VRX's mean errors of their poses [m], and in which rows an episode has ended."""
        given = torch.nn.functional.pad(actions.clamp(-1, 1), (0, 4))
        after, errors = self.seen, torch.zeros(len(actions), device=self.device)
        over = errors > 0
        for _ in range(HOLD):
            found = self.rows.step(given if self.device == "cuda" else given.numpy())
            seen, reward, lost, cut = map(self.tensor, found[:4])
            after = torch.where(over[:, None], after, seen)
            errors, over = errors - 10 / HOLD * reward, over | lost | cut
        self.seen = seen
        return after, errors.float(), over


def network(inputs: int, outputs: int) -> torch.nn.Sequential:
    """Two layers of 64; nearly 0 at first."""
    last = torch.nn.Linear(64, outputs)
    torch.nn.init.orthogonal_(last.weight, 0.01)
    return torch.nn.Sequential(
        torch.nn.Linear(inputs, 64), torch.nn.Tanh(), torch.nn.Linear(64, 64), torch.nn.Tanh(), last
    )


@torch.no_grad()
def mean_error(boats: Boats, policy: torch.nn.Module) -> float:
    """VRX's score: the mean error of the pose over an episode, here over all rows, too [m]."""
    boats.seen = boats.begin()
    return sum(boats.step(policy(boats.seen))[1].mean().item() for _ in range(EPISODE)) / EPISODE


def main(device: str = "cpu", rows: int = 256, updates: int = 200) -> tuple[float, float]:
    """Train, and return the mean error [m] before and after."""
    torch.manual_seed(1)
    boats = Boats(rows, device)
    policy, value = network(boats.features, 4).to(device), network(boats.features, 1).to(device)
    spread = torch.full((4,), -0.7, device=device, requires_grad=True)
    optimizer = torch.optim.Adam([*policy.parameters(), *value.parameters(), spread], RATE)
    before = mean_error(boats, policy)
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = RATE * (1 - update / updates)
        kept = []
        with torch.no_grad():
            for _ in range(HORIZON):
                seen = boats.seen
                chosen = torch.distributions.Normal(policy(seen), spread.exp())
                action = chosen.sample()
                after, error, over = boats.step(action)
                worth, chance = value(seen), chosen.log_prob(action).sum(1, True)
                gain = DISCOUNT * value(after) - worth - 0.3 * error.sqrt()[:, None]
                kept.append([seen, action, chance, gain, worth, ~over[:, None]])
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
