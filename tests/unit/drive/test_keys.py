"""Keys of MuJoCo's window: the number pad has all ten digits."""

from vrx_mj.drive.terminal import window_key


def test_the_number_pad_gives_the_digits():
    assert [window_key(320 + digit) for digit in range(10)] == list("0123456789")
    assert window_key(319) is None
    assert window_key(330) is None
