"""A client's subscription: how often messages go, in which order, and how several wishes for one topic agree."""

import asyncio
import time

from vrx_mj.ros.rosbridge.codec import Options
from vrx_mj.ros.rosbridge.topics import Subscription

THROTTLE = 0.04


class Outbox:
    """Notes what is sent."""

    def __init__(self):
        self.sent = []

    def push(self, written, size, source, most):
        self.sent.append((*written[0](), most))

    def forget(self, source):
        self.sent.append("forgotten")


class Parcel:
    """A message that tells how it was asked for."""

    weight = 1

    def __init__(self, number):
        self.number = number

    def frames(self, topic, wish):
        return (self.number, wish.compression, wish.fragment_size)


def subscribed(work, *wishes):
    """What is sent while a coroutine works with a subscription that has these wishes."""
    outbox = Outbox()

    async def run():
        subscription = Subscription("/a", outbox)
        for number, wish in enumerate(wishes):
            subscription.add(str(number), wish)
        await work(subscription)

    asyncio.run(run())
    return outbox.sent


def numbers(sent):
    return [entry[0] for entry in sent]


async def five(subscription):
    for number in range(5):
        subscription.take(Parcel(number))
    await asyncio.sleep(5 * THROTTLE)


def test_without_a_throttle_everything_goes_at_once():
    assert numbers(subscribed(five, Options())) == [0, 1, 2, 3, 4]


def test_with_a_throttle_what_comes_between_is_left_out_or_the_last_ones_wait():
    assert numbers(subscribed(five, Options(throttle=THROTTLE))) == [0]
    assert numbers(subscribed(five, Options(throttle=THROTTLE, queue=2))) == [0, 3, 4]


def test_nothing_overtakes_what_waits():
    """The process is busy for longer than the throttle: what waits is due, and has not gone yet."""

    async def busy(subscription):
        subscription.take(Parcel(0))
        subscription.take(Parcel(1))
        time.sleep(1.5 * THROTTLE)
        subscription.take(Parcel(2))
        await asyncio.sleep(4 * THROTTLE)

    assert numbers(subscribed(busy, Options(throttle=THROTTLE, queue=5))) == [0, 1, 2]


def test_of_several_wishes_the_most_often_the_shortest_queue_and_the_smallest_pieces_count():
    sent = subscribed(five, Options(10.0, 7, 500, "cbor"), Options(0.0, 3, 200, "none"), Options(5.0, 9, 0, "none"))
    assert numbers(sent) == [0, 1, 2, 3, 4]
    assert set(sent) == {(number, "cbor", 200, 3) for number in range(5)}


def test_what_waits_goes_with_the_last_wish():
    async def end(subscription):
        subscription.take(Parcel(0))
        subscription.take(Parcel(1))
        subscription.remove("0")
        assert not subscription
        await asyncio.sleep(3 * THROTTLE)

    assert subscribed(end, Options(throttle=THROTTLE, queue=5))[1:] == ["forgotten"]
