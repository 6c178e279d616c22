// The page's own part: it says by itself when its server is silent, shows times in the viewer's zone, and lets Escape
// stop even from a text field.
if (!window.farhand) {
  const LOOK_MS = 200;
  const SILENT_AFTER_LOOKS = 8; // not a time: a page that was busy itself has not heard what it could hear
  const farhand = (window.farhand = { beat: null, heard: performance.now(), looks: 0 });
  const banner = document.createElement("div");
  banner.id = "fh-stale";
  banner.dataset.tp = "stale";
  document.body.appendChild(banner);
  setInterval(() => {
    const beat = document.querySelector("[data-tp=beat]")?.textContent;
    farhand.looks += 1;
    if (beat !== undefined && beat !== farhand.beat) {
      Object.assign(farhand, { beat, heard: performance.now(), looks: 0 });
    }
    const silent = farhand.looks > SILENT_AFTER_LOOKS;
    const silent_s = Math.floor((performance.now() - farhand.heard) / 1000);
    banner.style.opacity = silent ? "1" : "0";
    banner.textContent = silent
      ? `NO NEWS from the local site for ${silent_s} s: what you see is old, and buttons do nothing`
      : "";
  }, LOOK_MS);
  const clock = new Intl.DateTimeFormat([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });
  new MutationObserver(() => {
    for (const time of document.querySelectorAll("time[datetime]:not([title])")) {
      time.title = time.dateTime;
      time.textContent = clock.format(new Date(time.dateTime));
    }
  }).observe(document.body, { childList: true, subtree: true });
  addEventListener(
    "keydown",
    (event) => {
      if (event.key !== "Escape" || event.repeat) return;
      const stop = [...document.querySelectorAll("button")].find((button) => button.textContent.trim() === "STOP");
      stop?.click();
    },
    { capture: true },
  );
}
