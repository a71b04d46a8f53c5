// Sorts, filters and pages the table of a catalogue. The data stand in the page.
"use strict";
(() => {
  const PAGE = 100;
  const data = JSON.parse(document.getElementById("models-data").textContent);
  const models = data.models;
  const body = document.querySelector("table.models tbody");
  const heads = [...document.querySelectorAll("table.models th[data-key]")];
  const by = (id) => document.getElementById(id);
  const [find, standing, sort, turn, shown] =
    ["find", "standing", "sort", "turn", "shown"].map(by);
  const [earlier, later, place] = ["earlier", "later", "place"].map(by);
  const keys = {
    name: "n", standing: "s", time: "t", memory: "m", size: "b", before: "f", after: "a",
  };
  const words = new Set(["name", "standing"]);
  const compareText = new Intl.Collator(undefined, { numeric: true }).compare;
  let descends = false;
  let page = 0;
  let chosen = models;

  const NARROW = "\u202f";
  const count = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, NARROW);
  const bytes = (size) => {
    const units = ["B", "KiB", "MiB", "GiB", "TiB"];
    let unit = 0;
    for (; size >= 1024 && unit + 1 < units.length; unit++) size /= 1024;
    return size.toFixed(unit === 0 || size >= 100 ? 0 : 1) + NARROW + units[unit];
  };
  const seconds = (time) => {
    const whole = Math.round(time);
    const two = (n) => String(n).padStart(2, "0");
    if (whole < 10) return time.toFixed(2) + NARROW + "s";
    if (whole < 120) return time.toFixed(1) + NARROW + "s";
    if (whole < 7200) return Math.floor(whole / 60) + ":" + two(whole % 60) + NARROW + "min";
    return Math.floor(whole / 3600) + ":" + two(Math.floor((whole % 3600) / 60)) + NARROW + "h";
  };
  const beside = (way, rest) => (way === "" ? rest : way + "/" + rest);

  const make = (name, attributes, text) => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    return element;
  };

  const row = (model) => {
    const line = make("tr", {});
    const pictures = make("td", { class: "pictures" });
    if (model.p & 2) {
      for (const side of ["before", "after"]) {
        const src = beside(data.report, `pictures/${model.i}-${side}.png`);
        pictures.append(make("img", { src, alt: side, loading: "lazy", width: 64, height: 64 }));
      }
    }
    const name = make("td", { class: "words" });
    const text = make("bdi", { class: "name" }, model.n);
    if (model.p & 1) {
      const link = make("a", { href: beside(data.report, `models/${model.i}.html`) });
      link.append(text);
      name.append(link);
    } else {
      name.append(text);
    }
    if (model.r !== undefined) {
      name.append(" ", make("a", { href: beside(data.target, model.r), class: "result" }, "result"));
    }
    if (model.w !== undefined) name.append(make("div", { class: "why" }, model.w));
    const badge = make("td", { class: "words" });
    badge.append(make("span", { class: "badge is-" + model.s }, model.s));
    line.append(pictures, name, badge);
    const number = (label, value, shape) => {
      const shapes = value === undefined ? "" : shape(value);
      line.append(make("td", { class: "number", "data-name": label }, shapes));
    };
    number("Time", model.t, seconds);
    number("Memory", model.m, bytes);
    number("Size", model.b, bytes);
    number("Before", model.f, count);
    number("After", model.a, count);
    return line;
  };

  const draw = () => {
    const pages = Math.max(1, Math.ceil(chosen.length / PAGE));
    page = Math.min(page, pages - 1);
    const first = page * PAGE;
    body.replaceChildren(...chosen.slice(first, first + PAGE).map(row));
    place.textContent = `${page + 1} of ${pages}`;
    earlier.disabled = page === 0;
    later.disabled = page + 1 === pages;
    shown.textContent = `${count(chosen.length)} of ${count(models.length)} models`;
    turn.textContent = descends ? "\u2193" : "\u2191";
    for (const head of heads) {
      const sorted = head.dataset.key === sort.value;
      head.setAttribute("aria-sort", sorted ? (descends ? "descending" : "ascending") : "none");
    }
  };

  const choose = () => {
    const wanted = find.value.trim().toLowerCase();
    const matches = (model) =>
      (standing.value === "" || model.s === standing.value) &&
      (wanted === "" || (model.n + "\n" + (model.w ?? "")).toLowerCase().includes(wanted));
    chosen = models.filter(matches);
    const key = keys[sort.value];
    if (key !== undefined) {
      const sign = descends ? -1 : 1;
      const compare = words.has(sort.value) ? compareText : (a, b) => a - b;
      // What has no value comes last in both directions.
      chosen.sort((a, b) => {
        const [left, right] = [a[key], b[key]];
        if (left === undefined || right === undefined) {
          return (left === undefined) - (right === undefined);
        }
        return sign * compare(left, right);
      });
    } else if (descends) {
      chosen.reverse();
    }
    page = 0;
    draw();
  };

  const counts = new Map();
  for (const model of models) counts.set(model.s, (counts.get(model.s) ?? 0) + 1);
  for (const [word, number] of counts) {
    standing.append(make("option", { value: word }, `${word} (${count(number)})`));
  }
  const sortBy = (key) => {
    descends = sort.value === key ? !descends : !words.has(key);
    sort.value = key;
    choose();
  };
  for (const head of heads) {
    const button = make("button", { type: "button" }, head.textContent);
    button.addEventListener("click", () => sortBy(head.dataset.key));
    head.replaceChildren(button);
  }
  find.addEventListener("input", choose);
  standing.addEventListener("change", choose);
  sort.addEventListener("change", () => {
    descends = keys[sort.value] !== undefined && !words.has(sort.value);
    choose();
  });
  turn.addEventListener("click", () => {
    descends = !descends;
    choose();
  });
  const leaf = (by) => {
    page += by;
    draw();
    document.getElementById("models").scrollIntoView();
  };
  earlier.addEventListener("click", () => leaf(-1));
  later.addEventListener("click", () => leaf(1));
  by("controls").addEventListener("submit", (event) => event.preventDefault());
  document.documentElement.classList.add("scripted");
  // Also on the way back from another page, when the browser has filled in the fields again.
  window.addEventListener("pageshow", choose);
})();
