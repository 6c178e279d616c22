// The operator's hand in the browser: keys and a gamepad move it while an arm is taught or the robot is driven, and the camera
// stands still while an arm is taught. What is said to the server is a line in a hidden field of its page, see hand_keys.py.
if (!window.farhandHand) {
  window.farhandHand = true;
  const LINE_MS = 50, HOLD_MS = 350, PAUSE_MS = 1000;
  const STEPS = 5, FINE_STEPS = 1, KEY_SPEED = 0.5, FINE_SPEED = 0.1;
  const DEAD_ZONE = 0.12, DEAD_MAN = [4, 5]; // the shoulder buttons
  const KEYS = { L: [1, 0, 0], J: [-1, 0, 0], U: [0, 1, 0], O: [0, -1, 0], I: [0, 0, 1], K: [0, 0, -1] };
  const FIELDS = "input, textarea, select, [contenteditable=true], [role=slider], [role=combobox], [role=listbox], [role=textbox]";

  const page = (selector) => document.querySelector(selector);
  const teaches = () => page("[data-tp=gauge]") !== null;
  const hears = () => teaches() || page(".fh-coupled") !== null;
  const active = () => page("[data-tp=session]")?.textContent !== "watching";
  const field = () => page(".fh-here-hand")?.closest(".mantine-Paper-root[data-with-border]")?.querySelector("input");

  // Lines to the server
  const setValue = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const STILL = [0, 0, 0];
  let burst = "", steps = STILL, speed = STILL, moving = false, count = 0, said_ms = -Infinity;
  const say = () => {
    const input = field();
    if (!input) return;
    said_ms = performance.now();
    count += 1;
    setValue.call(input, [burst, steps, Number(moving), speed.map((part) => part.toFixed(2)), count].join(";"));
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const begin = () => {
    if (performance.now() - said_ms < PAUSE_MS) return;
    burst = Math.random().toString(36).slice(2, 10) || "a";
    steps = STILL;
  };

  // Keys: a press is a step while an arm is taught, and a key that stays down moves on
  const down = new Map();
  const keyOf = (event) => (/^[a-z]$/i.test(event.key) ? event.key.toUpperCase() : event.code.replace("Key", ""));
  addEventListener("keydown", (event) => {
    const key = keyOf(event), direction = KEYS[key];
    if (!direction || event.ctrlKey || event.altKey || event.metaKey || event.target.closest?.(FIELDS)) return;
    if (!hears() || !active()) return;
    event.preventDefault();
    if (event.repeat || down.has(key)) return;
    const size = event.shiftKey ? FINE_STEPS : STEPS;
    down.set(key, { since_ms: performance.now(), direction, share: event.shiftKey ? FINE_SPEED : KEY_SPEED });
    begin();
    steps = steps.map((n, axis) => n + size * direction[axis]);
    say();
  });
  addEventListener("keyup", (event) => down.delete(keyOf(event)) && tick());

  const byKeys = () => {
    const held = [...down.values()].filter(({ since_ms }) => performance.now() - since_ms >= HOLD_MS);
    if (!held.length || !hears()) return null;
    return STILL.map((_, axis) => held.reduce((sum, { direction, share }) => sum + share * direction[axis], 0));
  };

  // Gamepad: its sticks count only while a shoulder button is held, and only if it was pressed in this tab
  let ready = false;
  const byPad = () => {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((each) => each?.connected);
    const held = Boolean(pad && !document.hidden && active() && DEAD_MAN.some((button) => pad.buttons[button]?.pressed));
    document.body.toggleAttribute("data-pad", Boolean(pad));
    if (!held) {
      ready = Boolean(pad) && !document.hidden;
      return null;
    }
    if (!ready) return null;
    const stick = (axis) => {
      const way = pad.axes[axis] ?? 0, size = Math.min(Math.max(Math.abs(way) - DEAD_ZONE, 0) / (1 - DEAD_ZONE), 1);
      return Math.sign(way) * size * size;
    };
    return [stick(0), -stick(1), -stick(3)];
  };

  const tick = () => {
    const wanted = byPad() ?? byKeys(), goes = wanted !== null;
    if (goes && !moving) begin();
    const tells = goes || moving;
    moving = goes;
    speed = wanted ?? STILL;
    if (tells) say();
    document.body.toggleAttribute("data-hand-moves", moving);
  };
  setInterval(tick, LINE_MS);
  const letGo = () => {
    down.clear();
    ready = false;
    tick();
  };
  addEventListener("blur", letGo);
  for (const change of ["freeze", "resume"]) document.addEventListener(change, letGo);
  document.addEventListener("visibilitychange", letGo);
  addEventListener("gamepaddisconnected", tick);

  // The camera stands still while an arm is taught: a missed arrow must not turn the view. Its controls listen to the
  // document from the moment that a button goes down, hence after this; the arrows listen to the canvas, hence before.
  const fingers = new Set();
  addEventListener("pointerdown", (event) => fingers.add(event.pointerId), { capture: true });
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, (event) => fingers.delete(event.pointerId), { capture: true });
  document.addEventListener("pointermove", (event) => {
    const turns = event.buttons & 1 && fingers.size < 2 && event.target instanceof HTMLCanvasElement;
    if (turns && teaches()) event.stopImmediatePropagation();
  });
}
