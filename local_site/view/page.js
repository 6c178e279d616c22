// The page's own part: it says by itself when its server is silent, and Escape stops even from a text field.
if (!window.farhand) {
  const SILENT_AFTER_MS = 1500;
  const farhand = (window.farhand = { beat: null, heard: performance.now() });
  const banner = document.createElement("div");
  banner.id = "fh-stale";
  banner.dataset.tp = "stale";
  document.body.appendChild(banner);
  setInterval(() => {
    const beat = document.querySelector("[data-tp=beat]")?.textContent;
    const now = performance.now();
    if (beat !== undefined && beat !== farhand.beat) {
      farhand.beat = beat;
      farhand.heard = now;
    }
    const silent = now - farhand.heard;
    banner.style.opacity = silent > SILENT_AFTER_MS ? "1" : "0";
    banner.textContent =
      silent > SILENT_AFTER_MS
        ? `NO NEWS from the local site for ${Math.floor(silent / 1000)} s: what you see is old, and buttons do nothing`
        : "";
  }, 200);
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
