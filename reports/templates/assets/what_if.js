(function () {
  "use strict";

  /* A loop tried with other settings: the same law, valve and process as the nightly advice, on the same load. */

  function bytes(text) {
    const raw = atob(text);
    const out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i += 1) out[i] = raw.charCodeAt(i);
    return out.buffer;
  }

  function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  }

  const FARTHEST = 1000; // a setting that is meant is no farther from the present one

  function figureOf(value) {
    if (!isFinite(value)) return "–";
    return Math.abs(value) >= 100 ? value.toFixed(0) : String(Number(value.toPrecision(3)));
  }

  /* A stem behind play or stick-slip: at rest until |OP - stem| exceeds `breakaway`, then at the distance `sliding`. */
  function follower(valve, start) {
    let stem = start, moving = 0, turned = start;
    const ideal = !(valve.breakaway > 0), tolerance = valve.tolerance === null ? -Infinity : valve.tolerance;
    return (op) => {
      if (ideal) return op;
      if (moving !== 0) {
        const advance = moving * (op - turned);
        if (advance < -tolerance) moving = 0;
        else if (advance > 0) { turned = op; stem = op - moving * valve.sliding; return stem; }
      }
      if (moving === 0) {
        const gap = op - stem;
        if (gap > valve.breakaway) { stem = op - valve.sliding; moving = 1; turned = op; }
        else if (gap < -valve.breakaway) { stem = op + valve.sliding; moving = -1; turned = op; }
      }
      return stem;
    };
  }

  /* The load, after a kick that sets a loop with a faulty valve going. */
  function kicked(model, load, kp, tiS) {
    const p = model.prelude, slowest = Math.max(p.slowest_s, isFinite(tiS) ? tiS : 0);
    if (!(p.kick > 0)) return { load, skipped: 0 };
    const hold = Math.floor(Math.min(Math.max(p.times * slowest / model.scan_s, p.least), load.length));
    const half = Math.floor(hold / 2), kick = p.kick / Math.abs(kp);
    const out = new Float64Array(1 + half + hold + load.length).fill(load[0], 0, 1 + half + hold);
    for (let k = 1; k <= half; k += 1) out[k] += kick;
    out.set(load, 1 + half + hold);
    return { load: out, skipped: 1 + half + hold };
  }

  /* Without integral action the bias of OP compensates the load's mean, and the simulation begins with it. */
  function driven(model, load, kp, tiS) {
    if (isFinite(tiS) && tiS > 0) return kicked(model, load, kp, tiS);
    const mean = load.reduce((sum, x) => sum + x, 0) / Math.max(load.length, 1);
    const all = kicked(model, Float64Array.from(load, (x) => x - mean), kp, Infinity);
    const out = new Float64Array(1 + all.load.length);
    out.set(all.load, 1);
    return { load: out, skipped: 1 + all.skipped };
  }

  function simulate(model, load, kp, tiS) {
    const all = driven(model, load, kp, tiS), d = all.load, n = d.length, p = model.process, h = model.scan_s;
    const ki = isFinite(tiS) && tiS > 0 ? kp * h / tiS : 0, c = model.controller;
    const most = c.most === null ? Infinity : c.most;
    const acting = function (error) {
      const e = c.gap > 0 ? error + (c.gap_gain - 1) * Math.min(Math.max(error, -c.gap), c.gap) : error;
      return c.squared ? e * Math.abs(e) / 100 : e;
    };
    const error = new Float64Array(n), op = new Float64Array(n), stem = new Float64Array(n);
    const stemAt = follower(model.valve, model.op_start);
    let y = 0, u = model.op_start, y1 = d[0], slope = 0;
    for (let k = 0; k < n; k += 1) {
      const pv = y + d[k], seen = c.pv_keep * y1 + (1 - c.pv_keep) * pv, e = acting(-seen), before = slope;
      slope = c.slope_keep * slope - kp * c.slope * (seen - y1);
      const move = kp * (e - acting(-y1)) + ki * e + slope - before;
      u = Math.min(Math.max(u + Math.min(Math.max(move, -most), most), model.op_lo), model.op_hi);
      y1 = seen;
      error[k] = -pv; op[k] = u; stem[k] = stemAt(u);
      const late = k >= p.delay ? stem[k - p.delay] - model.op_start : 0;
      const later = k >= p.delay + 1 ? stem[k - p.delay - 1] - model.op_start : 0;
      y = p.pole * y + p.now * late + p.before * later;
    }
    const from = all.skipped + Math.floor(model.warm_up * load.length);
    return { error: error.subarray(from), op: op.subarray(from), stem: stem.subarray(from) };
  }

  function figures(model, run) {
    let travel = 0, sum = 0, peak = 0;
    for (let k = 0; k < run.error.length; k += 1) {
      if (k) travel += Math.abs(run.stem[k] - run.stem[k - 1]);
      sum += Math.abs(run.error[k]);
      peak = Math.max(peak, Math.abs(run.error[k]));
    }
    const hours = run.error.length * model.scan_s / 3600;
    return [travel / hours, sum / run.error.length * model.pv_scale, peak * model.pv_scale];
  }

  /* Settings as the plant's controller states them, and back: its form, its unit of gain, its unit of time. */
  function units(model) {
    const law = model.law, seconds = { s: 1, min: 60 };
    return {
      stated(kp, tiS) {
        let gain = kp / law.ratio, ti = tiS;
        if (law.form === "parallel") ti = tiS / Math.abs(gain);
        if (law.form === "series" && model.td_s > 0 && isFinite(tiS)) {
          const share = (1 + Math.sqrt(Math.max(0, 1 - 4 * model.td_s / tiS))) / 2;
          gain *= share; ti *= share;
        }
        const time = !isFinite(ti) ? 0 : law.ti_unit === "repeats/min" ? 60 / ti : ti / seconds[law.ti_unit];
        return [law.band ? 100 / gain : gain, time];
      },
      ideal(kpStated, tiStated, before) {
        let gain = law.band ? 100 / kpStated : kpStated;
        let ti = tiStated === 0 ? Infinity : law.ti_unit === "repeats/min" ? 60 / tiStated : tiStated * seconds[law.ti_unit];
        if (law.form === "parallel") ti *= Math.abs(gain);
        if (law.form === "series" && model.td_s > 0 && isFinite(ti)) {
          const td = Math.min(before.tdSeries || model.td_s, ti);
          gain *= 1 + td / ti; ti += td;
        }
        return [gain * law.ratio, ti];
      },
    };
  }

  function started(figure) {
    const model = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
    const load = Float64Array.from(new Uint16Array(bytes(model.load.data)), (v) => model.load.low + v * model.load.step);
    const convert = units(model), now = model.settings[0];
    const field = (kind, type) => figure.querySelector('input[type="' + type + '"][data-of="' + kind + '"]');
    const slides = { kp: field("kp", "range"), ti: field("ti", "range") };
    const boxes = { kp: field("kp", "number"), ti: field("ti", "number") };
    const body = figure.querySelector("tbody"), said = figure.querySelector("output");
    const holders = figure.querySelectorAll(".panel");
    figure.querySelectorAll(".unit").forEach((u) => { u.textContent = model.law[u.dataset.of + "_unit"]; });
    const base = simulate(model, load, now.kp, now.ti_s === null ? Infinity : now.ti_s), before = figures(model, base);
    const middle = { kp: Math.abs(now.kp), ti: now.ti_s === null ? model.ti_middle_s : now.ti_s };
    const reach = Math.log(model.spread);
    let set = { kp: now.kp, ti: now.ti_s === null ? Infinity : now.ti_s };
    const rows = ["Stem travel [%/h]", "Average absolute error [" + model.pv_unit + "]", "Largest error [" + model.pv_unit + "]"];
    const hours = Float64Array.from(base.error, (_, k) => k * model.scan_s / 3600);
    const plots = [];

    /* Why a number that was typed in is not taken; empty where it is. */
    function refused(kind, text, pair) {
      const value = Number(text), name = kind === "kp" ? "Kp" : "Ti";
      if (text.trim() === "" || !isFinite(value)) return name + " needs a number.";
      if (kind === "kp" && (value === 0 || value < 0 !== now.kp < 0)) return "Kp needs a number " + (now.kp < 0 ? "below" : "above") + " 0, as now.";
      if (kind === "ti" && value < 0) return "Ti needs a number above 0, or 0 for no integral action.";
      const size = kind === "kp" ? Math.abs(pair[0]) : pair[1];
      if (isFinite(size) && (size > middle[kind] * FARTHEST || size < middle[kind] / FARTHEST)) return name + " is over " + FARTHEST + " times from the present one.";
      return "";
    }

    /* Whether a simulation ran away: its error is ten spans, or OP stands at its ends for a fifth of the time while the
       error does not die away (ours: a loop that recovers from a load is at an end once, and calmer in the second half). */
    function ranAway(run) {
      const half = run.error.length >> 1, ends = run.op.filter((u) => u <= model.op_lo || u >= model.op_hi).length;
      let early = 0, late = 0;
      for (let k = 0; k < run.error.length; k += 1) {
        if (k < half) early = Math.max(early, Math.abs(run.error[k])); else late = Math.max(late, Math.abs(run.error[k]));
      }
      return !isFinite(late) || late > 1e3 || (ends > 0.2 * run.op.length && late > 0.9 * early);
    }

    function slideOf(kind) {
      const value = kind === "kp" ? Math.abs(set.kp) : set.ti;
      if (!isFinite(value)) return 1000;
      return Math.round(500 * (1 + Math.log(value / middle[kind]) / reach));
    }

    function tried() {
      const run = simulate(model, load, set.kp, set.ti), after = figures(model, run), lost = ranAway(run);
      body.replaceChildren(...rows.map((name, i) => {
        const row = document.createElement("tr"), change = 100 * (after[i] / before[i] - 1);
        const sign = Math.abs(change) < 0.5 || !isFinite(change) ? "" : change < 0 ? "better" : "worse";
        [[name, ""], [figureOf(before[i]), "n"], [lost ? "unstable" : figureOf(after[i]), "n"],
          [lost ? "–" : isFinite(change) ? (change > 0 ? "+" : "") + change.toFixed(0) + " %" : "–", "n " + sign]].forEach(([text, kind], c) => {
          const cell = document.createElement(c ? "td" : "th");
          if (!c) cell.scope = "row";
          cell.textContent = text;
          if (kind) cell.className = kind;
          row.append(cell);
        });
        return row;
      }));
      figure.dataset.travel = String(after[0]);
      figure.dataset.error = String(after[1]);
      if (plots.length) {
        const scaled = (x) => Array.from(x, (v) => v * model.pv_scale);
        plots[0].setData([hours, scaled(base.error), scaled(run.error)], false);
        plots[1].setData([hours, base.op, run.op, run.stem], false);
        plots.forEach((u) => u.setScale("x", { min: shown.min, max: shown.max }));
      }
      const stated = convert.stated(set.kp, set.ti);
      said.textContent = lost ? "Unstable with these settings: OP goes from end to end, or the error grows." : "Kp " + figureOf(stated[0]) + " " + model.law.kp_unit + ", Ti " + figureOf(stated[1]) + " " + model.law.ti_unit +
        ": travel " + figureOf(after[0]) + " %/h, average absolute error " + figureOf(after[1]) + " " + model.pv_unit + ".";
    }

    function told() {
      const stated = convert.stated(set.kp, set.ti);
      boxes.kp.value = Number(stated[0].toPrecision(3));
      boxes.ti.value = Number(stated[1].toPrecision(3));
      slides.kp.value = slideOf("kp");
      slides.ti.value = slideOf("ti");
      slides.kp.setAttribute("aria-valuetext", boxes.kp.value + " " + model.law.kp_unit);
      slides.ti.setAttribute("aria-valuetext", boxes.ti.value + " " + model.law.ti_unit);
    }

    let due = 0;
    function changed() {
      told();
      cancelAnimationFrame(due);
      due = requestAnimationFrame(tried);
    }

    ["kp", "ti"].forEach((kind) => {
      slides[kind].addEventListener("input", () => {
        const value = middle[kind] * Math.exp(reach * (Number(slides[kind].value) / 500 - 1));
        set = kind === "kp" ? { ...set, kp: Math.sign(now.kp) * value } : { ...set, ti: value };
        changed();
      });
      boxes[kind].addEventListener("change", () => {
        const pair = convert.ideal(Number(boxes.kp.value), Number(boxes.ti.value), model);
        const why = refused(kind, boxes[kind].value, pair);
        const beside = figure.querySelector('.refused[data-of="' + kind + '"]');
        beside.textContent = why;
        boxes[kind].setAttribute("aria-invalid", why ? "true" : "false");
        if (why) return;
        set = { kp: Math.sign(now.kp) * Math.abs(pair[0]), ti: pair[1] };
        changed();
      });
    });

    const choices = figure.querySelector(".choices");
    model.settings.forEach((s) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = s.name;
      button.addEventListener("click", () => {
        set = { kp: s.kp, ti: s.ti_s === null ? Infinity : s.ti_s };
        changed();
      });
      choices.append(button);
    });
    figure.querySelector("form").addEventListener("submit", (event) => event.preventDefault());

    const shown = { min: Math.max(0, hours[hours.length - 1] - model.opening_h), max: hours[hours.length - 1] };
    const axis = (extra) => ({ stroke: () => colour("quiet"), grid: { stroke: () => colour("rule"), width: 1 },
      ticks: { stroke: () => colour("rule"), width: 1 }, font: "11px sans-serif", ...extra });
    const line = (label, name, dash) => ({ label, stroke: () => colour(name), width: 1.2, dash, points: { show: false } });
    const sync = uPlot.sync(figure.id);
    const panels = [
      { label: "SP − PV [" + model.pv_unit + "]", height: 220, series: [line("now", "quiet"), line("with these settings", "pv")] },
      { label: "OP and stem [%]", height: 170, series: [line("now", "quiet"), line("with these settings", "op"), line("stem", "stuck", [5, 3])] },
    ];
    panels.forEach((panel, i) => {
      const options = {
        width: Math.max(holders[i].clientWidth, 200), height: panel.height, legend: { show: false },
        series: [{}, ...panel.series], scales: { x: { time: false, auto: false, range: (u, min, max) => [min, max] } },
        axes: [axis({ space: 70, values: (u, splits) => splits.map((s) => figureOf(s) + " h") }),
          axis({ label: panel.label, labelSize: 18, labelFont: "11px sans-serif", size: 48 })],
        cursor: { sync: { key: sync.key }, drag: { x: true, y: false }, y: false },
        hooks: { setSelect: [(u) => {
          if (u.select.width < 4) return;
          shown.min = u.posToVal(u.select.left, "x");
          shown.max = u.posToVal(u.select.left + u.select.width, "x");
          plots.forEach((p) => p.setScale("x", { ...shown }));
        }] },
      };
      const u = new uPlot(options, [hours, ...panel.series.map(() => hours)], holders[i]);
      u.over.addEventListener("dblclick", () => {
        shown.min = 0;
        shown.max = hours[hours.length - 1];
        plots.forEach((p) => p.setScale("x", { ...shown }));
      });
      plots.push(u);
    });
    const legend = figure.querySelector(".legend");
    [["now", "key-now"], ["with these settings: error", "key-pv"], ["OP", "key-op"], ["stem", "key-stuck"]].forEach(([text, kind]) => {
      const key = document.createElement("span");
      key.className = kind;
      key.textContent = text;
      legend.append(key, " ");
    });
    new ResizeObserver(() => plots.forEach((u, i) => u.setSize({ width: Math.max(holders[i].clientWidth, 200), height: u.height }))).observe(figure);
    ["(prefers-color-scheme: dark)", "print"].forEach((query) => {
      matchMedia(query).addEventListener("change", () => plots.forEach((u) => u.redraw()));
    });
    const first = model.settings[Math.min(1, model.settings.length - 1)];
    set = { kp: first.kp, ti: first.ti_s === null ? Infinity : first.ti_s };
    told();
    tried();
    figure.dataset.ready = "yes";
  }

  document.querySelectorAll("figure.whatif").forEach(started);
})();
