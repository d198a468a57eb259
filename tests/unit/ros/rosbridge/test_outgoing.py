"""What waits for a client: how much it is, what goes first, and what is thrown away."""

from vrx_mj.ros.limits import MOST_REPLIES, MOST_REPLY_BYTES, Counts, Outgoing


def put(outgoing, source, size, most=0):
    outgoing.message(source, lambda: [b"x" * size], False, size, most)


def following(outgoing):
    """The frames that are sent next."""
    return outgoing._next()[0]()


def test_what_waits_is_counted_until_it_is_taken_or_forgotten():
    counts = Counts()
    outgoing = Outgoing(counts)
    for source, size in (("a", 10), ("b", 200), ("a", 3000)):
        put(outgoing, source, size)
    assert counts.waiting == 3210
    outgoing.forget("a")
    assert counts.waiting == 200
    assert following(outgoing) == [b"x" * 200]
    assert counts.waiting == 0
    assert outgoing._next() is None
    assert counts.dropped == 0


def test_of_a_topic_with_a_queue_the_oldest_goes():
    counts = Counts()
    outgoing = Outgoing(counts)
    for size in (1, 2, 3):
        put(outgoing, "a", size, most=2)
    put(outgoing, "b", 50, most=2)
    assert counts.dropped == 1
    assert [len(following(outgoing)[0]) for _ in range(3)] == [2, 3, 50]


def test_replies_go_before_messages():
    outgoing = Outgoing(Counts())
    put(outgoing, "a", 5)
    assert outgoing.reply([b"yes"])
    assert [following(outgoing) for _ in range(2)] == [[b"yes"], [b"xxxxx"]]


def test_a_client_that_takes_no_replies_gets_no_more_but_one_may_be_large():
    outgoing = Outgoing(Counts())
    assert outgoing.reply([b"x" * (MOST_REPLY_BYTES + 1)])
    assert not outgoing.reply([b"y"])
    many = Outgoing(Counts())
    assert all(many.reply([b"y"]) for _ in range(MOST_REPLIES))
    assert not many.reply([b"y"])
    many._next()
    assert many.reply([b"y"])
