"""Calls and headers of ROS 1 as its programs send them, to be mutated."""

from ros1_peer import ME

NOBODY = "http://127.0.0.1:1/"
TREE = {"a": [1, 2.5, "x", True], "b": {"c": {"d": "text" * 20}}}
CALLS = {
    "master": [
        ("registerPublisher", ("/fuzz", "/fuzz/topic", "std_msgs/String", NOBODY)),
        ("registerService", ("/fuzz", "/fuzz/service", "rosrpc://127.0.0.1:1", NOBODY)),
        ("unregisterPublisher", ("/fuzz", "/fuzz/topic", NOBODY)),
        ("setParam", ("/fuzz", "~tree", TREE)),
        ("getParam", ("/fuzz", "~tree/b")),
        ("deleteParam", ("/fuzz", "~tree/a")),
        ("searchParam", ("/fuzz/deep/down", "tree/b")),
        ("getSystemState", ("/fuzz",)),
        ("getPublishedTopics", ("/fuzz", "/wamv")),
        ("lookupService", ("/fuzz", "/trigger")),
        ("system.multicall", ([{"methodName": "getPid", "params": ["/fuzz"]}] * 3,)),
    ],
    "node": [
        ("requestTopic", ("/fuzz", "/course", [["TCPROS"], ["UDPROS", b"\0" * 20, "host", 1, 1500]])),
        ("publisherUpdate", ("/fuzz", "/none", [NOBODY])),
        ("paramUpdate", ("/fuzz", "/tree", TREE)),
        ("getBusInfo", ("/fuzz",)),
        ("getBusStats", ("/fuzz",)),
        ("getSubscriptions", ("/fuzz",)),
    ],
}
HEADERS = [
    {"callerid": ME, "topic": "/course", "md5sum": "*", "type": "std_msgs/String", "tcp_nodelay": "1"},
    {"callerid": ME, "topic": "/wamv/imu", "md5sum": "*", "message_definition": "float64 x\n" * 30},
    {"callerid": ME, "service": "/trigger", "md5sum": "*", "persistent": "1"},
    {"callerid": ME, "service": "/failing", "md5sum": "*", "probe": "1"},
]
