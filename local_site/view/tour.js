// Tour of five cards: once on the first visit, and from Help. A card covers neither STOP nor the line of actions.
if (!window.farhandTour) {
  window.farhandTour = true;
  const KEY = "farhand-tour", LEAST_PX = 700;
  const { open: help, card: title, back, next, end, close, cards } = window.farhandWords.tour;
  const seen = () => {
    try { return localStorage.getItem(KEY) !== null; } catch { return true; } // a browser that keeps nothing would ask each time
  };
  const remember = () => {
    try { localStorage.setItem(KEY, "seen"); } catch { /* it is shown from Help alone */ }
  };
  const add = (tag, attributes, parent) => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    return parent.appendChild(element);
  };
  const button = (id, label, parent, press) => {
    const made = add("button", { id, class: "fh-own", type: "button" }, parent);
    made.textContent = label;
    made.addEventListener("click", press);
    return made;
  };

  let card = null, at = 0;
  const finish = () => {
    remember();
    card?.remove();
    card = null;
    delete document.body.dataset.tour;
  };
  const show = (number) => {
    at = number;
    card?.remove();
    const label = title.replace("{}", at + 1).replace("{}", cards.length);
    card = add("section", { id: "fh-tour", role: "dialog", "aria-label": label, "aria-describedby": "fh-tour-text" }, document.body);
    document.body.dataset.tour = at + 1;
    const [heading, text] = cards[at];
    add("h2", {}, card).textContent = heading;
    add("p", { id: "fh-tour-text" }, card).textContent = text;
    const row = add("div", {}, card);
    add("span", {}, row).textContent = `${at + 1} / ${cards.length}`;
    if (at + 1 < cards.length) button("fh-tour-close", close, row, finish);
    if (at > 0) button("fh-tour-back", back, row, () => go(at - 1));
    button("fh-tour-next", at + 1 < cards.length ? next : end, row, () => (at + 1 < cards.length ? go(at + 1) : finish()));
  };
  const go = (number) => {
    show(number);
    document.getElementById("fh-tour-next").focus();
  };
  button("fh-help", help, document.body, () => (card ? finish() : go(0)));
  if (!seen() && innerWidth >= LEAST_PX) show(0);
}
