(function () {
  "use strict";

  /* Tables: sorting by buttons in the headings, filtering by text and by one column. */

  function keyOf(row, index) {
    const cell = row.cells[index];
    const number = cell.getAttribute("data-sort");
    return number === null ? cell.textContent.trim() : Number(number);
  }

  function compare(a, b) {
    if (typeof a === "number" && typeof b === "number") return a - b;
    if (typeof a === "number") return -1;
    if (typeof b === "number") return 1;
    return a.localeCompare(b, "en", { numeric: true });
  }

  function sortBy(table, index, direction) {
    const body = table.tBodies[0];
    const keyed = [];
    Array.from(body.rows).forEach((row) => { // one that stands under another goes where that goes
      if (keyed.length && row.cells[0].textContent.trim().startsWith("\u2514")) keyed[keyed.length - 1].rows.push(row);
      else keyed.push({ rows: [row], key: keyOf(row, index) });
    });
    keyed.sort((p, q) => {
      if ((p.key === "") !== (q.key === "")) return p.key === "" ? 1 : -1;
      return direction * compare(p.key, q.key);
    });
    const piece = document.createDocumentFragment();
    keyed.forEach((k) => piece.append(...k.rows));
    body.appendChild(piece);
  }

  function sortable(table) {
    const heads = Array.from(table.tHead.rows[0].cells);
    heads.forEach((head, index) => {
      const button = head.querySelector("button");
      if (!button) return; // a column without a heading
      button.addEventListener("click", () => {
        const first = head.classList.contains("n") ? "descending" : "ascending";
        const other = first === "ascending" ? "descending" : "ascending";
        const next = head.getAttribute("aria-sort") === first ? other : first;
        heads.forEach((h) => h.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", next);
        sortBy(table, index, next === "ascending" ? 1 : -1);
      });
    });
  }

  function filterable(tools) {
    const table = document.getElementById(tools.dataset.for);
    const rows = Array.from(table.tBodies[0].rows, (row) => ({ row, text: row.textContent.toLowerCase() }));
    const search = tools.querySelector("input");
    const said = tools.querySelector("output");
    const heads = Array.from(table.tHead.rows[0].cells);
    const facets = Array.from(tools.querySelectorAll("select"), (select) => (
      { select, at: heads.findIndex((h) => h.dataset.key === select.dataset.facet) }));
    const textAt = (row, at) => row.cells[at].textContent.trim();
    facets.forEach(({ select, at }) => {
      const values = new Set(rows.map((r) => textAt(r.row, at)).filter((v) => v));
      Array.from(values).sort().forEach((v) => select.add(new Option(v, v)));
      select.addEventListener("change", apply);
    });
    function apply() {
      const words = search.value.toLowerCase().split(/\s+/).filter((w) => w);
      let shown = 0;
      rows.forEach((r) => {
        const fits = words.every((w) => r.text.includes(w)) &&
          facets.every(({ select, at }) => !select.value || textAt(r.row, at) === select.value);
        r.row.hidden = !fits;
        shown += fits ? 1 : 0;
      });
      said.textContent = shown === rows.length ? rows.length + " rows" : shown + " of " + rows.length + " rows";
    }
    search.addEventListener("input", apply);
    apply();
  }

  /* Trends: two panels over one time axis; wheel and drag zoom, shift-drag and keys move, double click shows all. */

  function bytes(text) {
    const raw = atob(text);
    const out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i += 1) out[i] = raw.charCodeAt(i);
    return out.buffer;
  }

  function decoded(coded) {
    return Array.from(new Uint16Array(bytes(coded.data)), (v) => (v === 65535 ? null : coded.low + v * coded.step));
  }

  function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  }

  const asked = document.documentElement.dataset.zone || "UTC";
  const clock = clockOf(asked) || clockOf("UTC");
  const zone = clock.resolvedOptions().timeZone;

  function clockOf(name) {
    try {
      return new Intl.DateTimeFormat("en-GB", { timeZone: name, hourCycle: "h23", year: "numeric", month: "2-digit",
        day: "2-digit", hour: "2-digit", minute: "2-digit", second: "2-digit" });
    } catch (error) {
      return null;
    }
  }

  function stamp(seconds) {
    const part = {};
    clock.formatToParts(new Date(seconds * 1000)).forEach((p) => { part[p.type] = p.value; });
    return part.year + "-" + part.month + "-" + part.day + " " + part.hour + ":" + part.minute + ":" + part.second;
  }

  function figureOf(value) {
    return Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(3);
  }

  function seriesOf(band) {
    const stroke = () => colour(band.kind);
    const common = { stroke, width: 1, points: { show: false }, spanGaps: false };
    return [{ ...common, label: band.label + " max" }, { ...common, label: band.label + " min" }];
  }

  function marksOn(u, marks) {
    const ctx = u.ctx;
    ctx.save();
    ctx.strokeStyle = colour("worse");
    ctx.fillStyle = colour("worse");
    ctx.setLineDash([6, 4]);
    ctx.font = Math.round(11 * devicePixelRatio) + "px sans-serif";
    marks.forEach((mark) => {
      const x = u.valToPos(mark.x, "x", true);
      if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) return;
      ctx.beginPath();
      ctx.moveTo(x, u.bbox.top);
      ctx.lineTo(x, u.bbox.top + u.bbox.height);
      ctx.stroke();
      ctx.fillText(mark.label, x + 4, u.bbox.top + 12 * devicePixelRatio);
    });
    ctx.restore();
  }

  function spansOn(u, spans) {
    const ctx = u.ctx;
    ctx.save();
    ctx.globalAlpha = 0.12;
    ctx.fillStyle = colour("worse");
    spans.forEach((span) => {
      const left = Math.max(u.valToPos(span[0], "x", true), u.bbox.left);
      const right = Math.min(u.valToPos(span[1], "x", true), u.bbox.left + u.bbox.width);
      if (right > left) ctx.fillRect(left, u.bbox.top, right - left, u.bbox.height);
    });
    ctx.restore();
  }

  function trend(figure) {
    const data = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
    const time = Array.from(new Uint32Array(bytes(data.time)), (v) => v * data.tick + data.start);
    if (time.length < 2) return;
    const whole = { min: time[0], max: time[time.length - 1] };
    const holders = figure.querySelectorAll(".panel");
    const readout = figure.querySelector(".readout");
    const values = data.bands.map((b) => ({ low: decoded(b.low), high: decoded(b.high) }));
    const plots = [];
    let now = { ...whole };

    function show(min, max, alone) {
      const least = Math.min(20 * (whole.max - whole.min) / time.length, whole.max - whole.min);
      const width = Math.min(Math.max(max - min, least), whole.max - whole.min);
      const first = Math.min(Math.max(min, whole.min), whole.max - width);
      now = { min: first, max: first + width };
      figure.dataset.from = String(now.min);
      figure.dataset.to = String(now.max);
      plots.forEach((u) => u.setScale("x", now));
      if (!alone) figure.dispatchEvent(new CustomEvent("moved", { bubbles: true, detail: { ...now } }));
    }
    figure.addEventListener("follow", (event) => show(event.detail.min, event.detail.max, true));

    function zoom(factor, share) {
      const at = now.min + (now.max - now.min) * share;
      show(at - (at - now.min) * factor, at + (now.max - at) * factor);
    }

    function move(share) {
      const by = (now.max - now.min) * share;
      show(now.min + by, now.max + by);
    }

    function told(index) {
      readout.replaceChildren();
      if (index === null || index === undefined) return;
      readout.append(stamp(time[index]) + " " + zone);
      data.bands.forEach((band, i) => {
        const low = values[i].low[index], high = values[i].high[index];
        if (low === null) return;
        const key = document.createElement("span");
        key.className = "key-" + band.kind;
        key.textContent = band.label;
        const text = figureOf(low) === figureOf(high) ? figureOf(low) : figureOf(low) + " … " + figureOf(high);
        readout.append("   ", key, " " + text);
      });
    }

    function handlers(u) {
      const over = u.over;
      over.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && !event.metaKey) return; // the page scrolls, unless the trend is meant
        event.preventDefault();
        const box = over.getBoundingClientRect();
        zoom(event.deltaY < 0 ? 0.75 : 1 / 0.75, (event.clientX - box.left) / box.width);
      }, { passive: false });
      over.addEventListener("mousedown", (event) => {
        if (!event.shiftKey && event.button !== 1) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        const width = over.getBoundingClientRect().width, from = { ...now }, x = event.clientX;
        const drag = (e) => {
          const by = (x - e.clientX) / width * (from.max - from.min);
          show(from.min + by, from.max + by);
        };
        const drop = () => {
          document.removeEventListener("mousemove", drag);
          document.removeEventListener("mouseup", drop);
        };
        document.addEventListener("mousemove", drag);
        document.addEventListener("mouseup", drop);
      }, true);
      over.addEventListener("dblclick", () => show(whole.min, whole.max));
      fingers(over);
    }

    /* Two fingers zoom and move; one scrolls the page. */
    function fingers(over) {
      const at = new Map();
      let from = null;
      over.style.touchAction = "pan-y";
      over.addEventListener("pointerdown", (event) => {
        if (event.pointerType !== "touch") return;
        at.set(event.pointerId, event.clientX);
        from = at.size === 2 ? { x: Array.from(at.values()), now: { ...now } } : null;
      });
      over.addEventListener("pointermove", (event) => {
        if (!at.has(event.pointerId)) return;
        at.set(event.pointerId, event.clientX);
        if (!from || at.size !== 2) return;
        const box = over.getBoundingClientRect(), x = Array.from(at.values());
        const time = from.x.map((p) => from.now.min + (p - box.left) / box.width * (from.now.max - from.now.min));
        if (Math.abs(x[1] - x[0]) < 10 || (x[1] - x[0]) * (time[1] - time[0]) <= 0) return;
        const rate = (time[1] - time[0]) / (x[1] - x[0]), min = time[0] - (x[0] - box.left) * rate;
        show(min, min + box.width * rate);
      });
      ["pointerup", "pointercancel", "pointerleave"].forEach((kind) => over.addEventListener(kind, (event) => {
        at.delete(event.pointerId);
        from = null;
      }));
    }

    function reached(panel) {
      const least = (data.least || [])[panel] || 0;
      return (u, min, max) => {
        if (min === null || max === null) return [0, 1];
        const wanted = Math.max(max - min, least), spare = (wanted - (max - min)) / 2;
        const pad = 0.05 * (wanted || 1);
        return [min - spare - pad, max + spare + pad];
      };
    }

    function axis(extra) {
      return { stroke: () => colour("quiet"), grid: { stroke: () => colour("rule"), width: 1 },
        ticks: { stroke: () => colour("rule"), width: 1 }, font: "11px sans-serif", ...extra };
    }

    function ticks(u, splits, axisIndex, space, step) {
      return splits.map((s) => {
        if (s === null) return "";
        const text = stamp(s);
        return step >= 86400 || text.endsWith("00:00:00") ? text.slice(5, 10) : text.slice(11, step < 60 ? 19 : 16);
      });
    }

    const sync = uPlot.sync(figure.id);
    data.panels.forEach((label, panel) => {
      const own = data.bands.map((band, i) => ({ band, i })).filter((b) => b.band.panel === panel);
      if (!own.length) return;
      const rows = [time], series = [{}], bands = [];
      own.forEach(({ band, i }) => {
        bands.push({ series: [rows.length, rows.length + 1], fill: () => colour(band.kind) });
        rows.push(values[i].high, values[i].low);
        series.push(...seriesOf(band));
      });
      const options = {
        width: Math.max(holders[panel].clientWidth, 200), height: panel === 0 ? 240 : 150,
        tzDate: (ts) => uPlot.tzDate(new Date(ts * 1000), zone),
        legend: { show: false }, series, bands,
        scales: { x: { time: true, auto: false, min: whole.min, max: whole.max, range: () => [now.min, now.max] },
          y: { range: reached(panel) } },
        axes: [axis({ space: 70, values: ticks }), axis({ label, labelSize: 18, labelFont: "11px sans-serif", size: 48, space: panel === 0 ? 30 : 16 })],
        cursor: { sync: { key: sync.key }, drag: { x: true, y: false, setScale: false }, y: false, focus: { prox: -1 } },
        hooks: {
          drawClear: [(u) => spansOn(u, data.spans)],
          draw: [(u) => marksOn(u, data.marks)],
          setCursor: [(u) => told(u.cursor.idx)],
          setSelect: [(u) => {
            if (u.select.width < 4) return;
            show(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
            u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          }],
        },
      };
      const u = new uPlot(options, rows, holders[panel]);
      handlers(u);
      plots.push(u);
    });

    const actions = [["+", "Zoom in", () => zoom(0.5, 0.5)], ["−", "Zoom out", () => zoom(2, 0.5)],
      ["◀", "Earlier", () => move(-0.25)], ["▶", "Later", () => move(0.25)],
      ["All", "Show all", () => show(whole.min, whole.max)]];
    const keys = figure.querySelector(".keys");
    actions.forEach(([text, label, act]) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.setAttribute("aria-label", label);
      button.addEventListener("click", act);
      keys.append(button);
    });
    const byKey = { "+": 0, "=": 0, "-": 1, ArrowLeft: 2, ArrowRight: 3, 0: 4 };
    figure.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in byKey)) return;
      event.preventDefault();
      actions[byKey[event.key]][2]();
    });

    function fit() {
      plots.forEach((u, i) => u.setSize({ width: Math.max(holders[i].clientWidth, 200), height: u.height }));
    }
    new ResizeObserver(fit).observe(figure);
    ["(prefers-color-scheme: dark)", "print"].forEach((query) => {
      matchMedia(query).addEventListener("change", () => plots.forEach((u) => u.redraw()));
    });
    show(...(data.opening || [whole.min, whole.max]));
    figure.dataset.ready = "yes";
  }

  /* Trends of several loops under each other, chosen by boxes or by the page's address, moved as one. */
  function beside(box) {
    const most = Number(box.dataset.most), place = box.querySelector(".together"), said = box.querySelector("output");
    const boxes = Array.from(box.querySelectorAll('input[type="checkbox"]')), search = box.querySelector('input[type="search"]');
    const drawn = new Map();
    function apply() {
      const chosen = boxes.filter((b) => b.checked).map((b) => b.value);
      drawn.forEach((figure, name) => {
        if (!chosen.includes(name)) { figure.remove(); drawn.delete(name); }
      });
      chosen.filter((name) => !drawn.has(name)).forEach((name) => {
        const kept = Array.from(box.querySelectorAll("template")).find((t) => t.dataset.of === name);
        const figure = kept.content.firstElementChild.cloneNode(true), other = drawn.values().next().value;
        place.append(figure);
        drawn.set(name, figure);
        trend(figure);
        if (other) figure.dispatchEvent(new CustomEvent("follow", { detail: { min: Number(other.dataset.from), max: Number(other.dataset.to) } }));
      });
      boxes.forEach((b) => { b.disabled = !b.checked && chosen.length >= most; });
      said.textContent = chosen.length + " of at most " + most + " chosen";
      history.replaceState(null, "", "#" + chosen.map(encodeURIComponent).join(","));
    }
    place.addEventListener("moved", (event) => drawn.forEach((figure) => {
      if (figure !== event.target) figure.dispatchEvent(new CustomEvent("follow", { detail: event.detail }));
    }));
    search.addEventListener("input", () => boxes.forEach((b) => {
      b.closest("li").hidden = !b.checked && !b.value.toLowerCase().includes(search.value.toLowerCase().trim());
    }));
    const wanted = location.hash.slice(1).split(",").map(decodeURIComponent).slice(0, most);
    boxes.forEach((b) => { b.checked = wanted.includes(b.value); b.addEventListener("change", apply); });
    apply();
    box.dataset.ready = "yes";
  }

  /* Boxes beside the names of a table's loops, and a button that lays those chosen beside each other. */
  function choosable(tools) {
    const table = document.getElementById(tools.dataset.for), button = document.createElement("button");
    const boxes = Array.from(table.tBodies[0].rows).filter((row) => row.cells[0].querySelector("a")).map((row) => {
      const box = document.createElement("input"), name = row.cells[0].textContent.trim().replace("\u2514 ", "");
      box.type = "checkbox";
      box.value = name;
      box.setAttribute("aria-label", "Choose " + name);
      const label = document.createElement("label");
      label.append(box);
      row.cells[0].prepend(label, " ");
      box.addEventListener("change", told);
      return box;
    });
    const chosen = () => boxes.filter((b) => b.checked).map((b) => encodeURIComponent(b.value));
    function told() {
      const count = chosen().length;
      button.textContent = count ? "Show " + count + " side by side" : "Choose loops to show side by side";
      button.disabled = count < 2 || count > 6;
    }
    button.type = "button";
    button.addEventListener("click", () => { location.href = tools.dataset.beside + "#" + chosen().join(","); });
    tools.append(button);
    told();
  }

  document.querySelectorAll("main table").forEach(sortable);
  document.querySelectorAll("select.nights").forEach((select) => {
    select.addEventListener("change", () => { location.href = select.value; });
  });
  document.querySelectorAll(".tools").forEach(filterable);
  document.querySelectorAll(".tools[data-beside]").forEach(choosable);
  document.querySelectorAll("figure.trend").forEach(trend);
  document.querySelectorAll(".beside").forEach(beside);
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));
})();
