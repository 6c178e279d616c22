// The page's own part: STOP, which nothing hides; what stays in a narrow window; and word of a server that is silent.
if (!window.farhand) {
  const LOOK_MS = 200;
  const SMALL_PX = 620; // less room than this has none for the two cards beside each other
  const SILENT_AFTER_LOOKS = 8; // not a time: a page that was busy itself has not heard what it could hear
  const words = window.farhandWords;
  const farhand = (window.farhand = { beat: null, heard: performance.now(), looks: 0 });

  const add = (tag, attributes, parent = document.body) => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    return parent.appendChild(element);
  };
  const show = (element, text) => {
    if (element.textContent !== text) element.textContent = text;
  };
  const saying = (name) => document.querySelector(`[data-tp=${name}]`);
  const said = (name) => saying(name)?.textContent ?? "";
  // The server's buttons stay in the document wherever their panel is folded away.
  const served = (label) =>
    [...document.querySelectorAll("button:not(.fh-own)")].find((button) => button.textContent.trim() === label);

  // STOP
  const stop = add("button", { id: "fh-stop", class: "fh-own", type: "button", "aria-label": "STOP" });
  add("b", {}, stop).textContent = "STOP";
  add("small", {}, stop).textContent = "Esc";
  const stopDoes = add("span", {}, stop);
  const pressStop = () => served("STOP")?.click();
  stop.addEventListener("click", pressStop);
  addEventListener("keydown", (event) => event.key === "Escape" && !event.repeat && pressStop(), { capture: true });

  // A narrow window
  const narrow = add("section", { id: "fh-narrow", "aria-label": "Robot" });
  const line = (name, kind) => add("div", { "data-narrow": name, class: kind }, narrow);
  const mode = line("mode", "fh-narrow-mode"), age = line("age", "fh-narrow-age");
  const alarm = line("alarm", "fh-narrow-alarm"), advice = line("advice", "fh-narrow-advice");
  const actions = line("actions", "fh-narrow-actions");
  for (const label of words.narrowButtons) {
    const button = add("button", { class: "fh-own", type: "button", "data-label": label }, actions);
    button.textContent = label;
    button.addEventListener("click", () => served(label)?.click());
  }
  show(line("note", "fh-narrow-note"), words.narrow);
  const drawNarrow = () => {
    show(mode, [said("mode") || "UNKNOWN", said("phase")].filter(Boolean).join(" "));
    show(age, `data ${said("age") || "unknown"} old, link ${said("link") || "unknown"}`);
    show(alarm, said("stop"));
    show(advice, saying("role")?.dataset.inNarrow || (saying("advice")?.dataset.inNarrow ?? ""));
    for (const button of actions.children) {
      const own = served(button.dataset.label);
      button.hidden = !own || own.disabled || said("session") === "watching";
    }
  };

  // A silent server
  const banner = add("div", { id: "fh-stale", "data-tp": "stale", role: "alert" });
  const listen = () => {
    const beat = document.querySelector("[data-tp=beat]")?.textContent;
    farhand.looks += 1;
    if (beat !== undefined && beat !== farhand.beat) {
      Object.assign(farhand, { beat, heard: performance.now(), looks: 0 });
    }
    const silent = farhand.looks > SILENT_AFTER_LOOKS;
    const silent_s = Math.floor((performance.now() - farhand.heard) / 1000);
    banner.style.opacity = silent ? "1" : "0";
    show(banner, silent ? words.noNews.replace("{}", silent_s) : "");
  };

  // A file that is too large is not sent: a STOP would wait behind it. The server is told its name alone.
  addEventListener("change", ({ target }) => {
    const most = document.querySelector("[data-most-bytes]")?.dataset.mostBytes;
    if (target.type !== "file" || !target.files.length || !most || target.files[0].size <= Number(most)) return;
    const named = new DataTransfer();
    named.items.add(new File([], target.files[0].name));
    target.files = named.files;
  }, { capture: true });

  // Drawer and tabs: of this window alone, so the server does not know of them
  const menu = add("button", { id: "fh-menu", class: "fh-own", type: "button", "aria-expanded": "false" });
  menu.textContent = words.more;
  menu.addEventListener("click", () => {
    const open = document.body.toggleAttribute("data-drawer");
    menu.setAttribute("aria-expanded", open);
    show(menu, open ? words.close : words.more);
    makeRoom();
  });
  const tabs = add("div", { id: "fh-tabs", role: "tablist", "aria-label": words.details });
  const select = (name) => {
    document.body.dataset.tab = name;
    for (const tab of tabs.children) tab.setAttribute("aria-selected", tab.dataset.name === name);
  };
  for (const label of words.tabs) {
    const name = label.toLowerCase();
    const tab = add("button", { class: "fh-own", type: "button", role: "tab", id: `fh-tab-${name}`, "data-name": name }, tabs);
    tab.textContent = label;
    tab.addEventListener("click", () => select(name));
  }
  select("timeline");

  // A drag along the timeline moves the server's slider, which alone decides what is shown
  let scrubs = false;
  const setNumber = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const lookBack = (event) => {
    const svg = document.querySelector("[data-tp=timeline] svg");
    const folder = document.querySelector(".fh-here-time")?.closest("[data-with-border]");
    const input = folder?.querySelector("input.mantine-NumberInput-input");
    if (!svg || !input) return;
    const { left, right, span } = svg.dataset;
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse()).x;
    const part = Math.min(Math.max((right - at) / (right - left), 0), 1);
    setNumber.call(input, String(-Math.round(part * span)));
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  addEventListener("pointerdown", (event) => {
    scrubs = Boolean(event.target.closest?.("[data-tp=timeline] svg"));
    if (scrubs) lookBack(event);
  });
  addEventListener("pointermove", (event) => scrubs && lookBack(event));
  for (const name of ["pointerup", "pointercancel"]) addEventListener(name, () => { scrubs = false; });

  // What a screen reader says, and the window's title
  const live = add("div", { id: "fh-live", role: "status", "aria-live": "polite" });
  const urgent = add("div", { id: "fh-urgent", role: "alert" }, live);
  const calm = add("div", {}, live);
  const announce = () => {
    show(stopDoes, said("stop-does"));
    stop.setAttribute("aria-description", said("stop-does"));
    const does = [said("mode") || "UNKNOWN", said("phase")].filter(Boolean).join(" ");
    const alarming = said("stop").replace(/ \d+ s\b.*/, "");
    show(urgent, alarming);
    show(calm, [does, said("link") === "OK" ? "" : `link ${said("link")}`, said("past") && words.past, said("refusal"), said("miss")].filter(Boolean).join(", "));
    const title = `${alarming ? `! ${alarming}` : does} · Farhand`;
    if (document.title !== title) document.title = title;
    // viser gives its sliders and the numbers beside them no name
    const unnamed = '[role=slider][aria-label=""], input.mantine-NumberInput-input:not([aria-label])';
    for (const control of document.querySelectorAll(unnamed)) {
      let around = control.parentElement;
      while (around && !around.querySelector("label")) around = around.parentElement;
      const label = around?.querySelector("label");
      if (label) control.setAttribute("aria-label", label.textContent);
    }
  };

  // What lies over the canvas makes room for what grows: the advice, a second row of chips, an alarm, the words of the robot,
  // the drawer. The canvas keeps its size, and its view.
  const folder = (name) => document.querySelector(`.fh-here-${name}`)?.closest("[data-with-border]");
  const shownHeight = (element) => (element?.checkVisibility() ? element.offsetHeight : 0);
  const heightOf = (selector) => shownHeight(document.querySelector(selector));
  const gap = (height) => (height ? height + 6 : 0);
  const makeRoom = () => {
    const set = (name, size) => document.documentElement.style.setProperty(`--fh-${name}`, `${size}px`);
    const drawer = document.body.hasAttribute("data-drawer") ? document.querySelector("[data-dock-region]") : null;
    const room = innerWidth - (drawer?.offsetWidth ?? 0);
    set("room", room); // first: how many lines a text takes depends on it
    const views = folder("view"), legend = folder("legend");
    const stacked = (views?.offsetWidth ?? 0) + (legend?.offsetWidth ?? 0) + 24 > room;
    document.body.toggleAttribute("data-stacked", stacked);
    document.body.toggleAttribute("data-small", room < SMALL_PX);
    const [high, low] = [shownHeight(views), shownHeight(legend)];
    const sizes = {
      grown: shownHeight(folder("actions")), views: high, chips: stacked ? high + 6 + low : Math.max(high, low),
      robots: gap(heightOf(".fh-robots")), alarm: gap(heightOf(".fh-alarm")), own: heightOf(".fh-local"), its: heightOf(".fh-remote"),
    };
    for (const [name, size] of Object.entries(sizes)) set(name, size);
  };
  addEventListener("resize", makeRoom);

  const look = () => {
    makeRoom();
    listen();
    drawNarrow();
    announce();
  };
  look();
  setInterval(look, LOOK_MS);

  // Times in the zone of who looks
  const clock = new Intl.DateTimeFormat([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });
  new MutationObserver(() => {
    for (const time of document.querySelectorAll("time[datetime]:not([title])")) {
      time.title = time.dateTime;
      time.textContent = clock.format(new Date(time.dateTime));
    }
  }).observe(document.body, { childList: true, subtree: true });
}
