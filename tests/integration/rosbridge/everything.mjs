// What a user of roslibjs does. Arguments: the folder of its node_modules, the server's port. Prints what came as JSON.
import path from "node:path";
import { pathToFileURL } from "node:url";

const [folder, port] = process.argv.slice(2);
const ROSLIB = await import(pathToFileURL(path.join(folder, "node_modules/roslib/dist/RosLib.js")).href);
const IMU = "/wamv/sensors/imu/data";
const seen = {};

const connected = () =>
  new Promise((resolve, reject) => {
    const ros = new ROSLIB.Ros({ url: `ws://127.0.0.1:${port}` });
    ros.on("connection", () => resolve(ros));
    ros.on("error", reject);
  });

const topic = (ros, name, messageType, options = {}) => new ROSLIB.Topic({ ros, name, messageType, ...options });

const call = (ros, name, serviceType, request = {}) =>
  new Promise((resolve, reject) => new ROSLIB.Service({ ros, name, serviceType }).callService(request, resolve, reject));

const asked = (ros, method, ...rest) => new Promise((resolve, reject) => ros[method](...rest, resolve, reject));

// The next messages of a topic; none of them is on its way any more when it returns.
const first = async (wanted, count = 1) => {
  const got = [];
  await new Promise((resolve) => {
    wanted.subscribe((message) => {
      if (got.push(message) === count) resolve();
    });
  });
  wanted.unsubscribe();
  await asked(wanted.ros, "getNodes");
  return got.slice(0, count);
};

const ros = await connected();
const other = await connected();
for (const compression of ["none", "png", "cbor"]) {
  seen[compression] = (await first(topic(ros, IMU, "sensor_msgs/Imu", { compression })))[0];
}
seen.cbor.orientation_covariance = Array.from(seen.cbor.orientation_covariance, String);
const raw = (await first(topic(ros, IMU, "sensor_msgs/Imu", { compression: "cbor-raw" })))[0];
seen.raw = { secs: raw.secs, bytes: Buffer.from(raw.bytes).toString("base64") };
seen.image = (await first(topic(ros, "/wamv/sensors/camera/image_raw", "sensor_msgs/Image")))[0].data;
const pixels = (await first(topic(ros, "/wamv/sensors/camera/image_raw", "sensor_msgs/Image", { compression: "cbor" })))[0];
seen.pixels = Array.from(pixels.data);
const begin = performance.now();
await first(topic(ros, "/clock", "rosgraph_msgs/Clock", { throttle_rate: 100, queue_length: 1 }), 3);
seen.throttled = performance.now() - begin;
seen.latched = (await first(topic(other, "/vrx/task/info", "std_msgs/String")))[0].data;

topic(ros, "/wamv/cmd_vel", "geometry_msgs/Twist").publish({ linear: { x: 1 }, angular: { z: -0.5 } });

const talk = topic(ros, "/talk", "std_msgs/String", { latch: true });
talk.publish({ data: "ahoy" });
await asked(ros, "getTopics");
seen.talk = (await first(topic(other, "talk", "std_msgs/String")))[0].data;
seen.publishers = await new Promise((resolve) => talk.getPublishers(resolve));

seen.reset = await call(ros, "/gazebo/reset_world", "std_srvs/Empty");
seen.fire = await call(ros, "/wamv/fire", "std_srvs/Trigger");
seen.refused = await call(ros, "/gazebo/delete_model", "gazebo_msgs/DeleteModel", { model_name: "x" }).catch(String);

const adder = new ROSLIB.Service({ ros: other, name: "/add", serviceType: "rospy_tutorials/AddTwoInts" });
await adder.advertise((request, response) => {
  response.sum = request.a + request.b;
  return true;
});
const slow = new ROSLIB.Service({ ros: other, name: "/slow", serviceType: "std_srvs/Trigger" });
await slow.advertiseAsync(async () => ({ success: true, message: "later" }));
await asked(other, "getTopics");
seen.sum = await call(ros, "/add", "rospy_tutorials/AddTwoInts", { a: 2, b: 40 });
seen.slow = await call(ros, "/slow", "std_srvs/Trigger");
await adder.unadvertise();

const parameter = new ROSLIB.Param({ ros, name: "speed" });
await asked(parameter, "set", { limit: 2.5 });
seen.parameter = await asked(new ROSLIB.Param({ ros: other, name: "/speed" }), "get");
await asked(parameter, "delete");
seen.parameters = await asked(ros, "getParams");

seen.topics = await asked(ros, "getTopics");
seen.topicType = await asked(ros, "getTopicType", "/wamv/cmd_vel");
seen.topicsForType = await asked(ros, "getTopicsForType", "geometry_msgs/Twist");
seen.services = await asked(ros, "getServices");
seen.serviceType = await asked(ros, "getServiceType", "/wamv/fire");
seen.servicesForType = await asked(ros, "getServicesForType", "std_srvs/Empty");
seen.request = (await asked(ros, "getServiceRequestDetails", "gazebo_msgs/DeleteModel")).typedefs;
seen.response = (await asked(ros, "getServiceResponseDetails", "std_srvs/Trigger")).typedefs;
seen.imu = ros.decodeTypeDefs(await asked(ros, "getMessageDetails", "sensor_msgs/Imu"));
seen.nodes = await asked(ros, "getNodes");
seen.node = await asked(ros, "getNodeDetails", "/gazebo");
seen.actionServers = await asked(ros, "getActionServers");
const texts = await asked(ros, "getTopicsAndRawTypes");
seen.text = texts.typedefs_full_text[texts.topics.indexOf("/wamv/cmd_vel")];
const status = new Promise((resolve) => ros.once("status", resolve));
ros.authenticate("mac", "client", "dest", "rand", 0, "level", 0);
seen.status = (await status).msg;
ros.setStatusLevel("none");
ros.close();
other.close();
process.stdout.write(JSON.stringify(seen), () => process.exit(0)); // its service servers keep it alive
