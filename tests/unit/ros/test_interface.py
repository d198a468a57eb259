"""What came over networks and waits for the simulation: the newest of each sender, and no more than there is room."""

from vrx_mj.ros.interface import MOST_CALLS, MOST_UNKNOWN_PUBLISHERS, Inbox
from vrx_mj.ros.limits import MOST_WAITING


def test_of_what_comes_too_fast_the_oldest_goes_and_is_counted():
    inbox = Inbox()
    for number in range(MOST_WAITING + 6):
        inbox.message("/a", number, "me")
    inbox.message("/a", "one", "you")
    commands, _, _ = inbox.drain()
    assert [command.message for command in commands] == [*range(6, MOST_WAITING + 6), "one"]
    assert inbox._commands.dropped == 6
    assert inbox.drain() == ([], [], [])


def test_unknown_publishers_are_known_once_and_up_to_a_number():
    inbox = Inbox()
    for number in range(2 * MOST_UNKNOWN_PUBLISHERS):
        inbox.unknown_publisher(f"/topic_{number % (MOST_UNKNOWN_PUBLISHERS + 50)}", "std_msgs/Empty", "me")
    _, _, unknown_publishers = inbox.drain()
    assert len(unknown_publishers) == len({one.topic for one in unknown_publishers}) == MOST_UNKNOWN_PUBLISHERS


def test_calls_beyond_the_room_for_them_are_refused_at_once():
    inbox, refused = Inbox(), []
    for _ in range(MOST_CALLS + 2):
        inbox.call("/service", None, "me", lambda response, why: refused.append((response, why)))
    assert len(refused) == 2
    assert refused[0][0] is None
    assert len(inbox.drain()[1]) == MOST_CALLS


def test_what_has_come_is_pending_until_it_is_taken():
    inbox = Inbox()
    assert not inbox.pending
    inbox.message("/a", 1, "me")
    assert inbox.pending
    assert inbox.wait(0.0)
    inbox.drain()
    assert not inbox.pending
