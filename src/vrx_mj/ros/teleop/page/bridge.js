// A client of a rosbridge that connects again whenever the connection is lost.

const RETRY = 1500; // [ms]
const ANSWER_TIMEOUT = 20000; // for an answer [ms]

export class Bridge {
  constructor(url, { opened, closed, failed }) {
    this.url = url;
    this.handlers = { opened, closed, failed };
    this.listeners = new Map();
    this.calls = new Map();
    this.number = 0;
    this.connect();
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  connect() {
    this.socket = new WebSocket(this.url);
    this.advertised = new Set();
    this.socket.onopen = () => {
      for (const [topic, { type, period }] of this.listeners) this.ask(topic, type, period);
      this.handlers.opened();
    };
    this.socket.onmessage = (event) => this.take(JSON.parse(event.data));
    this.socket.onclose = () => {
      for (const { fail, timer } of this.calls.values()) {
        clearTimeout(timer);
        fail(new Error("the connection was lost"));
      }
      this.calls.clear();
      this.handlers.closed();
      setTimeout(() => this.connect(), RETRY);
    };
  }

  send(operation) {
    if (this.isOpen) this.socket.send(JSON.stringify(operation));
  }

  // One message every `period` [ms] at most.
  subscribe(topic, type, period, take) {
    this.listeners.set(topic, { type, period, take });
    this.ask(topic, type, period);
  }

  ask(topic, type, period) {
    this.send({ op: "subscribe", topic, type, throttle_rate: period, queue_length: 1 });
  }

  // With the last message the topic is left to others.
  publish(topic, type, msg, last) {
    if (!this.isOpen) return;
    if (!this.advertised.has(topic)) {
      this.advertised.add(topic);
      this.send({ op: "advertise", topic, type });
    }
    this.send({ op: "publish", topic, msg });
    if (last && this.advertised.delete(topic)) this.send({ op: "unadvertise", topic });
  }

  // The response; rejected with what went wrong, in words.
  call(service, args = {}) {
    return new Promise((done, fail) => {
      if (!this.isOpen) return fail(new Error("not connected"));
      const id = `call:${this.number++}`;
      const timer = setTimeout(() => {
        this.calls.delete(id);
        fail(new Error(`no answer in ${ANSWER_TIMEOUT / 1000} s`));
      }, ANSWER_TIMEOUT);
      this.calls.set(id, { done, fail, timer });
      this.send({ op: "call_service", id, service, args });
    });
  }

  take(message) {
    if (message.op === "publish") this.listeners.get(message.topic)?.take(message.msg);
    else if (message.op === "service_response" && this.calls.has(message.id)) {
      const { done, fail, timer } = this.calls.get(message.id);
      this.calls.delete(message.id);
      clearTimeout(timer);
      if (!message.result) fail(new Error(String(message.values)));
      else if (message.values?.success === false) fail(new Error(message.values.status_message));
      else done(message.values);
    } else if (message.op === "status" && message.level === "error") this.handlers.failed(message.msg);
  }
}
