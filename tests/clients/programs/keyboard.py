"""A keyboard script as teleop_twist_keyboard, in a terminal of its own in which somebody holds a key and then quits."""

import os
import pty
import select
import sys
import termios
import time
import tty


def drive():
    """In the terminal: a key is a twist, which is repeated until the next one; q ends it."""
    import rospy
    from geometry_msgs.msg import Twist

    rospy.init_node("keyboard", disable_signals=True)
    publisher = rospy.Publisher("/wamv/cmd_vel", Twist, queue_size=1)
    while not publisher.get_num_connections():
        time.sleep(0.05)
    settings = termios.tcgetattr(sys.stdin)
    twist, key = Twist(), ""
    print("reading from the keyboard", flush=True)
    try:
        tty.setraw(sys.stdin.fileno())
        while key != "q":
            key = os.read(0, 1).decode() if select.select([sys.stdin], [], [], 0.1)[0] else ""
            if key:
                twist.linear.x, twist.angular.z = {"i": (0.4, 0.0), "j": (0.0, 0.2)}.get(key, (0.0, 0.0))
            publisher.publish(twist)
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, settings)


def main():
    child, terminal = pty.fork()
    if child == 0:
        drive()
        sys.stdout.flush()
        os._exit(0)
    said = b""
    while b"keyboard" not in said:
        said += os.read(terminal, 1000)
    print("ready", flush=True)
    try:
        while True:
            os.write(terminal, b"i")
            time.sleep(0.2)
    except KeyboardInterrupt:
        os.write(terminal, b"q")
    print("the terminal ended with", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


main()
