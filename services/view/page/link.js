// The connection to the view process. It is reopened if it is lost, or if no message arrives for a long time.
const SILENCE_MS = 6000;
const FIRST_PAUSE_MS = 300;
const LONGEST_PAUSE_MS = 2000;

export class Link {
  // on: { state(word, class), text(value), picture({ view, frame, isDrawn, jpeg }), open() }
  constructor(on) {
    this.on = on;
    this.pause = FIRST_PAUSE_MS;
    this.heard = 0;
    this.open();
    // A page that the browser has suspended receives no messages.
    setInterval(() => {
      const isDeaf = this.isOpen() && this.expects && performance.now() - this.heard > SILENCE_MS;
      if (isDeaf && !document.hidden) this.socket.close();
    }, 1000);
  }

  isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/ws${location.search}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    // True if messages arrive regularly.
    this.expects = false;
    socket.onopen = () => {
      this.pause = FIRST_PAUSE_MS;
      this.heard = performance.now();
      this.on.open();
    };
    socket.onmessage = ({ data }) => {
      this.heard = performance.now();
      if (typeof data === "string") {
        const value = JSON.parse(data);
        this.expects ||= value.type === "state";
        this.on.text(value);
        return;
      }
      const head = new DataView(data);
      if (data.byteLength < 16 || head.getUint8(0) !== 1) return;
      const frame = Number(head.getBigUint64(8, true));
      this.on.picture({ view: head.getUint8(1), frame, isDrawn: head.getUint8(2) === 1, jpeg: new Blob([data.slice(16)], { type: "image/jpeg" }) });
    };
    socket.onclose = () => {
      this.on.state("no connection, retrying", "lost");
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(LONGEST_PAUSE_MS, 1.5 * this.pause);
    };
  }

  ask(question) {
    if (this.isOpen()) this.socket.send(JSON.stringify(question));
    return this.isOpen();
  }
}
