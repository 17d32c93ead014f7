"use strict";
(() => {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const small = (text) => text && new Int8Array(bytes(text));
  const components = (text) => text && Float64Array.from(new Int16Array(bytes(text)), (v) => v / 32767);
  const span = Math.log(Math.PI / scene.least);
  const angles = (text) => text && Float64Array.from(new Uint16Array(bytes(text)),
    (code) => (code ? scene.least * Math.exp((code - 1) / 65534 * span) : NaN));
  const directions = (text) => {
    const square = components(text);
    return Array.from({ length: square.length / 2 }, (_, k) => {
      let x = square[2 * k], y = square[2 * k + 1];
      const z = 1 - Math.abs(x) - Math.abs(y);
      if (z < 0) [x, y] = [(1 - Math.abs(y)) * (x < 0 ? -1 : 1), (1 - Math.abs(x)) * (y < 0 ? -1 : 1)];
      return unit([x, y, z]);
    });
  };

  const t = new Float32Array(bytes(scene.t));
  const q = components(scene.q), truth = components(scene.truth), known = small(scene.known);
  const bound = angles(scene.bound), error = angles(scene.error);
  const status = small(scene.status), broken = small(scene.broken);
  const channels = scene.channels.map((c) => ({
    name: c.name, b: directions(c.b), r: directions(c.r), cone: angles(c.cone), residual: angles(c.residual),
    state: small(c.state),
  }));
  const MISSING = 0, REJECTED = 2, OK = 0, INCONSISTENT = 2;
  const NONE = "no measurement";

  const $ = (id) => document.getElementById(id);
  const globe = $("globe"), lanes = $("lanes"), slider = $("time");
  const pen = globe.getContext("2d"), lanePen = lanes.getContext("2d");
  let yaw = 0.6, pitch = 0.35, at = 0, frame = "N", magnify = scene.magnify, playing = false, size = 300;
  let colour = {};

  function unit(v) { const n = Math.hypot(...v); return n > 0 ? v.map((c) => c / n) : [0, 0, 1]; }
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const sum = (a, x, b, y) => a.map((c, k) => c * x + b[k] * y);
  const quaternion = (all, k) => {
    const p = [all[4 * k], all[4 * k + 1], all[4 * k + 2], all[4 * k + 3]], n = Math.hypot(...p);
    return n > 0.5 ? p.map((c) => c / n) : null;
  };
  // the same vector in B components, b_B = A(q_BN) r_N, and back
  const toBody = ([x, y, z, w], v) => {
    const twice = cross([x, y, z], v).map((c) => 2 * c);
    return sum(sum(v, 1, twice, -w), 1, cross([x, y, z], twice), 1);
  };
  const toInertial = ([x, y, z, w], v) => toBody([-x, -y, -z, w], v);
  const turned = (v, axis, angle) => {
    const c = Math.cos(angle), s = Math.sin(angle);
    return sum(sum(v, c, cross(axis, v), s), 1, axis, dot(axis, v) * (1 - c));
  };
  const larger = (angle) => Math.min(Math.PI, angle * magnify);
  const project = (v) => {
    const x = Math.cos(yaw) * v[1] - Math.sin(yaw) * v[0], y = Math.cos(yaw) * v[0] + Math.sin(yaw) * v[1];
    return [size / 2 + 0.4 * size * x, size / 2 - 0.4 * size * (Math.cos(pitch) * v[2] - Math.sin(pitch) * y),
      Math.cos(pitch) * y + Math.sin(pitch) * v[2]];
  };

  function path(points, style, width, fill) {
    const seen = points.map(project);
    if (fill) {
      pen.globalAlpha = 0.16;
      pen.fillStyle = style;
      pen.beginPath();
      seen.forEach((p) => pen.lineTo(p[0], p[1]));
      pen.fill();
    }
    pen.strokeStyle = style;
    pen.lineWidth = width;
    for (const behind of [true, false]) {
      pen.globalAlpha = behind ? 0.28 : 1;
      pen.beginPath();
      for (let k = 1; k < seen.length; k += 1) {
        if ((seen[k][2] + seen[k - 1][2] < 0) !== behind) continue;
        pen.moveTo(seen[k - 1][0], seen[k - 1][1]);
        pen.lineTo(seen[k][0], seen[k][1]);
      }
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  function circle(centre, angle, style, width, fill) {
    const first = unit(cross(centre, Math.abs(centre[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), second = cross(centre, first);
    const c = Math.cos(angle), s = Math.sin(angle), points = [];
    for (let k = 0; k <= 72; k += 1) {
      const a = k * Math.PI / 36;
      points.push(sum(centre, c, sum(first, Math.cos(a), second, Math.sin(a)), s));
    }
    path(points, style, width, fill && angle < 1.5);
  }

  function arrow(v, style, width, label, dashed) {
    pen.setLineDash(dashed ? [5, 4] : []);
    path([[0, 0, 0], v], style, width);
    pen.setLineDash([]);
    if (label) write(label, v, style);
  }

  function mark(v, style, radius, filled) {
    const [x, y, depth] = project(v);
    pen.globalAlpha = depth < 0 ? 0.4 : 1;
    pen.strokeStyle = pen.fillStyle = style;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    if (filled) pen.fill(); else pen.stroke();
    pen.globalAlpha = 1;
  }

  function write(text, v, style) {
    const [x, y] = project(sum(v, 1.12, v, 0));
    pen.font = `600 ${size < 420 ? 13 : 15}px system-ui, "DejaVu Sans", sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    const half = pen.measureText(text).width / 2 + 2;
    const place = [Math.min(Math.max(x, half), size - half), Math.min(Math.max(y, 10), size - 10)];
    pen.lineWidth = 4;
    pen.lineJoin = "round";
    pen.strokeStyle = colour.raised;
    pen.strokeText(text, ...place);
    pen.fillStyle = style;
    pen.fillText(text, ...place);
  }

  function drawGlobe() {
    pen.clearRect(0, 0, size, size);
    const attitude = status[at] < 0 ? null : quaternion(q, at);
    const inBody = frame === "B";
    const fromN = (v) => (inBody ? attitude && toBody(attitude, v) : v);
    const fromB = (v) => (inBody ? v : attitude && toInertial(attitude, v));
    pen.strokeStyle = colour.line;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.arc(size / 2, size / 2, 0.4 * size, 0, 2 * Math.PI);
    pen.stroke();
    circle([0, 0, 1], Math.PI / 2, colour.line, 1);
    circle([1, 0, 0], Math.PI / 2, colour.line, 1);
    circle([0, 1, 0], Math.PI / 2, colour.line, 1);
    ["x", "y", "z"].forEach((name, k) => {
      const axis = fromN([0, 1, 2].map((j) => (j === k ? 1 : 0)));
      if (axis) arrow(axis, colour.quiet, 1, `${name} N`);
    });
    drawChannels(fromN, fromB);
    if (attitude) drawBody(attitude, inBody);
  }

  function drawChannels(fromN, fromB) {
    channels.forEach((channel, k) => {
      if (channel.state[at] === MISSING) return;
      const refused = channel.state[at] === REJECTED, style = refused ? colour.refused : colour.channels[k];
      const reference = fromN(channel.r[at]);
      let measured = fromB(channel.b[at]);
      if (reference) mark(reference, style, 7, false);
      if (measured && reference && channel.residual[at] > 0) {
        measured = turned(reference, unit(cross(reference, measured)), larger(channel.residual[at]));
      }
      if (measured) {
        arrow(measured, style, 2, "", refused);
        mark(measured, style, 3.5, true);
        circle(measured, Math.max(larger(channel.cone[at]), 1e-3), style, 1.5, true);
      }
      const label = refused ? `${channel.name} rejected` : channel.name;
      if (measured || reference) write(label, measured || reference, style);
    });
  }

  function drawBody(attitude, inBody) {
    const certain = status[at] === OK;
    ["x", "y", "z"].forEach((name, k) => {
      const axis = [0, 1, 2].map((j) => (j === k ? 1 : 0)), style = colour.axes[k];
      const place = (v) => (inBody ? v : toInertial(attitude, v));
      if (certain) circle(place(axis), Math.max(larger(bound[at]), 1e-3), style, 1.5, true);
      arrow(place(axis), style, 3.5, `${name} B`, !certain);
      const real = truth && known[at] ? quaternion(truth, at) : null;
      if (!real || !certain) return;
      // the rotation between the true and the determined attitude, its angle as large as the bound is drawn
      const [x, y, z, w] = real, [a, b, c, d] = attitude.map((v, j) => (j < 3 ? -v : v));
      const vector = sum(sum([a, b, c], w, [x, y, z], d), 1, cross([x, y, z], [a, b, c]), -1);
      const scalar = w * d - dot([x, y, z], [a, b, c]);
      const truly = turned(axis, unit(vector.map((v) => (scalar < 0 ? -v : v))), -larger(error[at]));
      crossMark(place(truly), style);
    });
  }

  function crossMark(v, style) {
    const [x, y] = project(v);
    pen.strokeStyle = style;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(x - 5, y - 5); pen.lineTo(x + 5, y + 5);
    pen.moveTo(x - 5, y + 5); pen.lineTo(x + 5, y - 5);
    pen.stroke();
  }

  const LANE = 18, HEAD = 92;
  const headWidth = () => Math.min(HEAD, lanes.clientWidth / 3);
  function drawLanes() {
    const width = lanes.clientWidth, height = LANE * (channels.length + 1);
    const head = headWidth(), place = (k) => head + (width - head) * (t[k] / (t[t.length - 1] || 1));
    lanePen.clearRect(0, 0, width, height);
    lanePen.font = '12px system-ui, "DejaVu Sans", sans-serif';
    lanePen.textBaseline = "middle";
    const outcome = (k) => {
      if (status[k] < 0) return null;
      if (status[k] === INCONSISTENT || broken[k]) return colour.refused;
      return status[k] === OK ? colour.good : colour.open;
    };
    const rows = [["attitude", outcome],
      ...channels.map((c, j) => [c.name, (k) => [null, colour.channels[j], colour.refused][c.state[k]]])];
    rows.forEach(([name, paint], row) => {
      lanePen.fillStyle = colour.quiet;
      lanePen.fillText(name, 0, LANE * (row + 0.5), head - 8);
      for (let k = 0, end; k < t.length; k = end) {
        const style = paint(k);
        for (end = k + 1; end < t.length && paint(end) === style;) end += 1;
        if (!style) continue;
        const left = place(k), right = end < t.length ? place(end) : width;
        lanePen.fillStyle = style;
        lanePen.fillRect(left, LANE * row + 4, Math.max(right - left, style === colour.refused ? 2 : 0.6), LANE - 8);
      }
    });
    lanePen.fillStyle = colour.ink;
    lanePen.fillRect(place(at) - 1, 0, 2, height);
  }

  const degrees = (angle) => (Number.isNaN(angle) ? "\u2013"
    : `${Number((angle * 180 / Math.PI).toPrecision(3))}\u00b0`);
  function tell() {
    const says = status[at] < 0 ? NONE : scene.statuses[status[at]];
    const rows = [["time", `${Number((scene.start + t[at]).toPrecision(8))} s`, "", false],
      ["attitude", says, "", status[at] !== OK],
      ["guaranteed bound", degrees(status[at] === OK ? bound[at] : NaN), "", false]];
    if (truth) rows.push(["true error", degrees(error[at]) + (broken[at] ? ", beyond the bound" : ""), "", broken[at]]);
    channels.forEach((c, k) => {
      const state = ["missing", `${degrees(c.residual[at])} of ${degrees(c.cone[at])}`, "rejected"][c.state[at]];
      const alert = c.state[at] === REJECTED || (c.state[at] !== MISSING && c.residual[at] > c.cone[at] * 1.001);
      rows.push([c.name, state, colour.channels[k], alert]);
    });
    $("readout").firstElementChild.replaceChildren(...rows.map(([name, value, swatch, alert]) => {
      const [line, term, said] = ["div", "dt", "dd"].map((kind) => document.createElement(kind));
      if (swatch) {
        const dot = term.appendChild(document.createElement("span"));
        dot.className = "swatch";
        dot.style.background = swatch;
      }
      term.append(name);
      said.textContent = value;
      if (alert) said.className = "alert";
      line.append(term, said);
      return line;
    }));
    slider.setAttribute("aria-valuetext", `${rows[0][1]}, ${says}`);
    $("before").disabled = nextMark(-1) < 0;
    $("after").disabled = nextMark(1) < 0;
  }

  const isMarked = (k) => status[k] !== OK || broken[k] === 1 || channels.some((c) => c.state[k] === REJECTED);
  function nextMark(step) {
    // the beginning of the next span of marked instants
    for (let k = at + step; k >= 0 && k < t.length; k += step) {
      if (isMarked(k) && !(k > 0 && isMarked(k - 1))) return k;
    }
    return -1;
  }

  function draw() {
    drawGlobe();
    drawLanes();
    tell();
  }
  function go(index) {
    at = Math.min(Math.max(index, 0), t.length - 1);
    slider.value = String(at);
    draw();
  }
  function fit() {
    const ratio = window.devicePixelRatio || 1;
    size = globe.clientWidth;
    globe.width = globe.height = Math.round(size * ratio);
    slider.style.marginLeft = `${headWidth()}px`;
    slider.style.width = `${lanes.clientWidth - headWidth()}px`;
    lanes.style.height = `${LANE * (channels.length + 1)}px`;
    lanes.width = Math.round(lanes.clientWidth * ratio);
    lanes.height = Math.round(LANE * (channels.length + 1) * ratio);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    lanePen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const style = getComputedStyle(document.documentElement), of = (name) => style.getPropertyValue(name).trim();
    colour = { axes: ["x", "y", "z"].map((n) => of(`--axis-${n}`)), channels: channels.map((_, k) => of(`--c${k % 5}`)),
      refused: of("--refused"), good: of("--good"), open: of("--open"), line: of("--line"), quiet: of("--quiet"),
      ink: of("--ink"), raised: of("--raised") };
    draw();
  }
  function turn(right, down) {
    yaw -= right / (0.4 * size);
    pitch = Math.min(Math.max(pitch + down / (0.4 * size), -1.57), 1.57);
    drawGlobe();
  }

  globe.addEventListener("pointermove", (event) => { if (event.buttons & 1) turn(event.movementX, event.movementY); });
  globe.addEventListener("pointerdown", (event) => globe.setPointerCapture(event.pointerId));
  globe.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[event.key];
    if (!step) return;
    event.preventDefault();
    turn(...step);
  });
  lanes.addEventListener("click", (event) => {
    const head = headWidth();
    const wanted = (event.offsetX - head) / (lanes.clientWidth - head) * t[t.length - 1];
    let best = 0;
    t.forEach((each, k) => { if (Math.abs(each - wanted) < Math.abs(t[best] - wanted)) best = k; });
    go(best);
  });
  slider.addEventListener("input", () => go(Number(slider.value)));
  $("frame").addEventListener("click", () => {
    frame = frame === "N" ? "B" : "N";
    $("frame").textContent = frame === "N" ? "Seen from N" : "Seen from B";
    drawGlobe();
  });
  $("magnify").value = String(magnify);
  $("magnify").addEventListener("change", () => { magnify = Number($("magnify").value); drawGlobe(); });
  $("before").addEventListener("click", () => go(nextMark(-1)));
  $("after").addEventListener("click", () => go(nextMark(1)));
  $("play").addEventListener("click", () => {
    playing = !playing;
    $("play").textContent = playing ? "Pause" : "Play";
    if (playing && at === t.length - 1) at = 0;
    const step = () => {
      if (!playing) return;
      go(at + Math.max(1, Math.round(t.length / 1500)));
      if (at === t.length - 1) { playing = false; $("play").textContent = "Play"; }
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", fit);
  window.addEventListener("resize", fit);
  fit();
})();
