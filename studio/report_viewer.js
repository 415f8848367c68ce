/* The 3-D view of the report: plays the fold plan by forward kinematics. Plain WebGL, no library. */
(function () {
  "use strict";
  const D = JSON.parse(document.getElementById("plan-data").textContent);
  const canvas = document.getElementById("view");
  const el = (id) => document.getElementById(id);
  const rad = Math.PI / 180;
  const faceCount = D.faces.length / 3;
  const stepCount = D.steps.length;
  const pieceCount = D.sheet.faces.length / 3;
  const onFrame = new Set(D.sheet.frame);

  /* ---- forward kinematics: a motion is 9 numbers of a rotation, then 3 of a shift ---- */
  const IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0];
  function compose(a, b) {
    const o = new Array(12);
    for (let r = 0; r < 3; r++) {
      for (let c = 0; c < 3; c++) o[3 * r + c] = a[3 * r] * b[c] + a[3 * r + 1] * b[3 + c] + a[3 * r + 2] * b[6 + c];
      o[9 + r] = a[3 * r] * b[9] + a[3 * r + 1] * b[10] + a[3 * r + 2] * b[11] + a[9 + r];
    }
    return o;
  }
  function apply(m, x, y, z) {
    return [
      m[0] * x + m[1] * y + m[2] * z + m[9],
      m[3] * x + m[4] * y + m[5] * z + m[10],
      m[6] * x + m[7] * y + m[8] * z + m[11],
    ];
  }
  function turnAbout(sx, sy, ex, ey, angle) {
    const l = Math.hypot(ex - sx, ey - sy), x = (ex - sx) / l, y = (ey - sy) / l;
    const c = Math.cos(angle), s = Math.sin(angle), v = 1 - c;
    const m = [c + x * x * v, x * y * v, y * s, x * y * v, c + y * y * v, -x * s, -y * s, x * s, c, 0, 0, 0];
    const p = apply(m, sx, sy, 0);
    m[9] = sx - p[0]; m[10] = sy - p[1]; m[11] = -p[2];
    return m;
  }

  /* ---- the state of the part at a time; time is counted in steps ---- */
  const childOf = {};
  D.creaseOf.forEach((e, f) => { if (e >= 0) childOf[e] = f; });
  function stateAt(time) {
    const s = {
      angle: new Float64Array(faceCount), rotary: 0, gone: new Set(), falling: new Set(), fall: 0, bent: [],
      release: 0, active: -1, done: Math.min(Math.floor(time), stepCount), cuts: [], beam: null,
    };
    const part = Math.min(time, stepCount) - s.done;
    for (let i = 0; i <= s.done && i < stepCount; i++) {
      const step = D.steps[i], now = i === s.done, f = now ? part : 1;
      if (now && f <= 0) break;
      if (step.op === "fold") {
        s.angle[step.face] = (step.from + (step.to - step.from) * f) * rad;
        if (now) { s.active = step.face; s.beam = { face: step.face, at: f }; }
      } else if (step.op === "rotate") {
        s.rotary += (step.to * rad - s.rotary) * ease(f);
      } else if (step.op === "clip") {
        step.faces.forEach((p) => (now ? s.falling : s.gone).add(p));
        if (now) s.fall = f;
      } else if (step.op === "bend") {
        s.bent.push({ faces: step.faces, hinge: step.hinge, angle: step.to * rad * f });
      } else if (step.op === "cut" || step.op === "release") {
        s.cuts.push({ paths: step.paths, share: f, now: now });
        if (step.op === "release") s.release = f;
      }
    }
    return s;
  }
  function ease(f) { return f * f * (3 - 2 * f); }
  function motionsOf(angle) {
    const m = new Array(faceCount);
    for (const f of D.order) {
      if (f === D.base) { m[f] = IDENTITY; continue; }
      const h = D.hinge, k = 4 * f;
      m[f] = compose(m[D.parent[f]], turnAbout(h[k], h[k + 1], h[k + 2], h[k + 3], angle[f]));
    }
    return m;
  }
  function cornersOf(motions) {
    const out = new Float64Array(9 * faceCount);
    for (let f = 0; f < faceCount; f++) {
      for (let k = 0; k < 3; k++) {
        const v = D.faces[3 * f + k];
        out.set(apply(motions[f], D.vertices[2 * v], D.vertices[2 * v + 1], 0), 9 * f + 3 * k);
      }
    }
    return out;
  }
  const goalAngles = new Float64Array(faceCount);
  for (const e in D.wanted) goalAngles[childOf[e]] = D.wanted[e] * rad;
  const goalCorners = cornersOf(motionsOf(goalAngles));

  /* ---- drawing ---- */
  const gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) {
    el("view-note").textContent = "This browser has no WebGL, so the 3-D view is not shown; everything else on the page is complete.";
    el("view-note").hidden = false;
  }
  const VERTEX = "attribute vec3 p; attribute vec3 n; attribute vec4 c; uniform mat4 m; uniform mat3 r;" +
    "varying vec3 vn; varying vec4 vc; void main(){ gl_Position = m * vec4(p,1.0); vn = r * n; vc = c; }";
  const FRAGMENT = "precision mediump float; varying vec3 vn; varying vec4 vc; uniform float lit;" +
    "void main(){ vec3 c = vc.rgb; if (lit > 0.5) { bool front = gl_FrontFacing; vec3 n = normalize(vn) * (front ? 1.0 : -1.0);" +
    "if (!front) c = c * vec3(1.0,0.94,0.84) * 0.95; float d = 0.5 + 0.5 * dot(n, normalize(vec3(-0.35,0.45,0.85)));" +
    "c *= 0.48 + 0.60 * d; } gl_FragColor = vec4(c * vc.a, vc.a); }";
  let program, where, buffer;
  if (gl) {
    program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(program, shader);
    }
    gl.linkProgram(program); gl.useProgram(program);
    where = { m: gl.getUniformLocation(program, "m"), r: gl.getUniformLocation(program, "r"), lit: gl.getUniformLocation(program, "lit") };
    buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    ["p", "n", "c"].forEach((name, i) => {
      const at = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, i === 2 ? 4 : 3, gl.FLOAT, false, 40, [0, 12, 24][i]);
    });
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1.5, 2);
    gl.clearColor(0.955, 0.962, 0.972, 1);
  }
  const COLOUR = {
    face: [0.70, 0.77, 0.84, 1], base: [0.56, 0.80, 0.72, 1], active: [0.98, 0.84, 0.50, 1], blocked: [0.93, 0.66, 0.74, 1],
    picked: [0.45, 0.70, 0.95, 1], sheet: [0.83, 0.84, 0.86, 1], frame: [0.66, 0.69, 0.73, 1], line: [0.16, 0.20, 0.26, 1],
    thin: [0.62, 0.65, 0.70, 1], beam: [0.84, 0.37, 0.0, 1], glow: [0.84, 0.37, 0.0, 0.22], goal: [0.0, 0.45, 0.70, 0.55],
    done: [0.16, 0.20, 0.26, 0.3], axis: [0.35, 0.35, 0.40, 0.8],
  };
  const blockedFaces = new Set(D.blocked.map((b) => b.face));
  const panel = new Set(D.panel);
  let picked = -1;
  const view = { turn: -0.6, tilt: 0.95, zoom: 1, shift: [0, 0] };
  const show = { sheet: true, beam: true, goal: false, machine: true };

  let time = stepCount, playing = false, last = 0;
  const sheetRadius = 0.5 * Math.hypot(span(D.sheet.outline, 0), span(D.sheet.outline, 1)) || 1;
  function span(list, at) {
    let low = Infinity, high = -Infinity;
    for (let i = at; i < list.length; i += 2) { low = Math.min(low, list[i]); high = Math.max(high, list[i]); }
    return high - low;
  }

  function push(list, p, n, c) { list.push(p[0], p[1], p[2], n[0], n[1], n[2], c[0], c[1], c[2], c[3]); }
  function triangle(list, a, b, c, colour) {
    const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    push(list, a, n, colour); push(list, b, n, colour); push(list, c, n, colour);
  }
  function line(list, a, b, colour) { push(list, a, [0, 0, 1], colour); push(list, b, [0, 0, 1], colour); }

  function draw() {
    const s = stateAt(time), motions = motionsOf(s.angle), corners = cornersOf(motions);
    tell(s);
    if (!gl) return;
    const rotary = show.machine ? turnAbout(0, 0, 1, 0, s.rotary) : IDENTITY;
    const place = (x, y, z) => apply(rotary, x, y, z);
    const faces = [], lines = [], glow = [], box = new Box();
    for (let f = 0; f < faceCount; f++) {
      const p = [0, 1, 2].map((k) => place(corners[9 * f + 3 * k], corners[9 * f + 3 * k + 1], corners[9 * f + 3 * k + 2]));
      p.forEach((q) => box.add(q));
      const colour = f === picked ? COLOUR.picked : f === s.active ? COLOUR.active : blockedFaces.has(f) ? COLOUR.blocked : panel.has(f) ? COLOUR.base : COLOUR.face;
      triangle(faces, p[0], p[1], p[2], colour);
      for (let k = 0; k < 3; k++) line(lines, p[k], p[(k + 1) % 3], COLOUR.line);
    }
    const free = ease(s.release);
    if (show.sheet && free < 1) {
      const bent = new Map();
      s.bent.forEach((b) => { const m = turnAbout(...b.hinge, b.angle); b.faces.forEach((p) => bent.set(p, m)); });
      const away = -0.6 * sheetRadius * free * (show.machine ? Math.cos(s.rotary) || 1 : 1);
      for (let q = 0; q < pieceCount; q++) {
        if (s.gone.has(q)) continue;
        const drop = (s.falling.has(q) ? -0.5 * sheetRadius * s.fall * s.fall : 0) + away;
        const m = bent.get(q) || IDENTITY;
        const p = [0, 1, 2].map((k) => {
          const v = D.sheet.faces[3 * q + k];
          const flat = apply(m, D.sheet.vertices[2 * v], D.sheet.vertices[2 * v + 1], 0);
          return place(flat[0], flat[1], flat[2] + drop);
        });
        const alpha = (s.falling.has(q) ? 1 - s.fall : 1) * (1 - free);
        const base = onFrame.has(q) ? COLOUR.frame : COLOUR.sheet;
        triangle(faces, p[0], p[1], p[2], [base[0], base[1], base[2], alpha]);
        for (let k = 0; k < 3; k++) line(lines, p[k], p[(k + 1) % 3], [COLOUR.thin[0], COLOUR.thin[1], COLOUR.thin[2], 0.35 * alpha]);
      }
      for (const cut of s.cuts) drawCut(cut, lines, place, show.beam ? glow : null);
    }
    if (show.goal) {
      for (let f = 0; f < faceCount; f++) for (let k = 0; k < 3; k++) {
        const a = 9 * f + 3 * k, b = 9 * f + 3 * ((k + 1) % 3);
        line(lines, place(goalCorners[a], goalCorners[a + 1], goalCorners[a + 2]), place(goalCorners[b], goalCorners[b + 1], goalCorners[b + 2]), COLOUR.goal);
      }
    }
    if (s.beam && show.beam) {
      const h = 4 * s.beam.face, m = motions[D.parent[s.beam.face]];
      const a = place(...apply(m, D.hinge[h], D.hinge[h + 1], 0)), b = place(...apply(m, D.hinge[h + 2], D.hinge[h + 3], 0));
      const sweep = 6 * s.beam.at, back = sweep % 2, f = back > 1 ? 2 - back : back;
      beam(a.map((x, i) => x + (b[i] - x) * f), lines, glow);
      line(lines, a, b, COLOUR.beam);
    }
    const part = box.radius(), whole = show.sheet ? Math.max(sheetRadius * 1.05, part) : part;
    const radius = whole + (part - whole) * (show.sheet ? free : 1);
    const centre = box.centre().map((x) => x * (show.sheet ? free : 1));
    paint(faces, lines, glow, radius, centre);
  }
  class Box {
    constructor() { this.low = [Infinity, Infinity, Infinity]; this.high = [-Infinity, -Infinity, -Infinity]; }
    add(p) { for (let i = 0; i < 3; i++) { this.low[i] = Math.min(this.low[i], p[i]); this.high[i] = Math.max(this.high[i], p[i]); } }
    centre() { return this.low.map((x, i) => 0.5 * (x + this.high[i])); }
    radius() { return 0.5 * Math.hypot(...this.low.map((x, i) => this.high[i] - x)) || 1; }
  }
  function drawCut(cut, lines, place, glow) {
    let total = 0;
    const lengths = cut.paths.map((p) => { let l = 0; for (let i = 2; i < p.length; i += 2) l += Math.hypot(p[i] - p[i - 2], p[i + 1] - p[i - 1]); total += l; return l; });
    let left = total * cut.share;
    cut.paths.forEach((p) => {
      for (let i = 2; i < p.length && left > 0; i += 2) {
        const l = Math.hypot(p[i] - p[i - 2], p[i + 1] - p[i - 1]) || 1e-9, f = Math.min(1, left / l);
        const end = place(p[i - 2] + (p[i] - p[i - 2]) * f, p[i - 1] + (p[i + 1] - p[i - 1]) * f, 0);
        line(lines, place(p[i - 2], p[i - 1], 0), end, cut.now ? COLOUR.beam : COLOUR.done);
        left -= l;
        if (left <= 0 && cut.now && glow) beam(end, lines, glow);
      }
    });
  }
  function beam(point, lines, glow) {
    const top = 1.2 * sheetRadius, wide = 0.035 * sheetRadius, ring = 10;
    for (let i = 0; i < ring; i++) {
      const a = (2 * Math.PI * i) / ring, b = (2 * Math.PI * (i + 1)) / ring;
      triangle(glow, point, [point[0] + wide * Math.cos(a), point[1] + wide * Math.sin(a), point[2] + top],
        [point[0] + wide * Math.cos(b), point[1] + wide * Math.sin(b), point[2] + top], COLOUR.glow);
    }
    line(lines, point, [point[0], point[1], point[2] + top], COLOUR.beam);
  }

  function paint(faces, lines, glow, radius, centre) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const ct = Math.cos(view.turn), st = Math.sin(view.turn), cx = Math.cos(view.tilt), sx = Math.sin(view.tilt);
    const rot = [ct, st, 0, -st * cx, ct * cx, sx, st * sx, -ct * sx, cx];
    const far = (radius * 2.7) / view.zoom, near = far * 0.05, end = far + 6 * sheetRadius + 6 * radius;
    const focal = 2.6, aspect = w / h, fx = aspect > 1 ? focal / aspect : focal, fy = aspect > 1 ? focal : focal * aspect;
    const c = centre;
    const tx = -(rot[0] * c[0] + rot[1] * c[1] + rot[2] * c[2]) + view.shift[0] * radius;
    const ty = -(rot[3] * c[0] + rot[4] * c[1] + rot[5] * c[2]) + view.shift[1] * radius;
    const tz = -(rot[6] * c[0] + rot[7] * c[1] + rot[8] * c[2]) - far;
    const a = -(end + near) / (end - near), b = (-2 * end * near) / (end - near);
    gl.uniformMatrix4fv(where.m, false, [
      fx * rot[0], fy * rot[3], a * rot[6], -rot[6], fx * rot[1], fy * rot[4], a * rot[7], -rot[7],
      fx * rot[2], fy * rot[5], a * rot[8], -rot[8], fx * tx, fy * ty, a * tz + b, -tz,
    ]);
    gl.uniformMatrix3fv(where.r, false, [rot[0], rot[3], rot[6], rot[1], rot[4], rot[7], rot[2], rot[5], rot[8]]);
    const send = (list, kind, lit) => {
      if (!list.length) return;
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list), gl.DYNAMIC_DRAW);
      gl.uniform1f(where.lit, lit);
      gl.drawArrays(kind, 0, list.length / 10);
    };
    send(faces, gl.TRIANGLES, 1);
    send(lines, gl.LINES, 0);
    gl.depthMask(false);
    send(glow, gl.TRIANGLES, 0);
    gl.depthMask(true);
  }

  /* ---- controls ---- */
  const slider = el("time"), rows = Array.from(document.querySelectorAll("tr[data-step]"));
  let marked = null;
  slider.max = stepCount;
  function tell(s) {
    const now = Math.min(Math.ceil(time) - 1, stepCount - 1), at = Math.max(now, 0);
    el("step-text").textContent = time <= 0 ? "flat sheet" : time >= stepCount ? "finished" : D.steps[at].text;
    el("step-number").textContent = Math.min(Math.ceil(time), stepCount) + " / " + stepCount;
    el("rotary-text").textContent = "rotary " + (s.rotary / rad).toFixed(0) + "°";
    slider.value = time;
    const row = time > 0 && time < stepCount ? rows[at] : null;
    if (row !== marked) {
      if (marked) marked.classList.remove("now");
      if (row) row.classList.add("now");
      if (row && playing) {
        const frame = row.closest(".scroll");
        if (frame) frame.scrollTop = row.offsetTop - 0.4 * frame.clientHeight;
      }
      marked = row;
    }
    document.querySelectorAll("#net .active").forEach((x) => x.classList.remove("active"));
    if (s.active >= 0) {
      const crease = document.querySelector('#net [data-crease="' + D.creaseOf[s.active] + '"]');
      if (crease) crease.classList.add("active");
    }
  }
  function seek(t) { time = Math.max(0, Math.min(stepCount, t)); draw(); }
  function play(on) {
    playing = on;
    el("play").textContent = on ? "❚❚" : "▶";
    el("play").setAttribute("aria-label", on ? "pause" : "play");
    if (on) { if (time >= stepCount) time = 0; last = 0; requestAnimationFrame(tick); }
  }
  function tick(now) {
    if (!playing) return;
    if (last) {
      const step = D.steps[Math.min(Math.floor(time), stepCount - 1)];
      const pace = { fold: 1.2, rotate: 1.2, cut: 0.7, wait: 6, clip: 1.0, bend: 1.0, release: 0.6 }[step.op] || 1;
      time = Math.min(stepCount, time + Math.min((now - last) / 1000, 0.1) * pace * Number(el("speed").value));
    }
    last = now;
    draw();
    if (time >= stepCount) play(false); else requestAnimationFrame(tick);
  }
  slider.addEventListener("input", () => { play(false); seek(Number(slider.value)); });
  el("play").addEventListener("click", () => play(!playing));
  el("previous").addEventListener("click", () => { play(false); seek(Math.ceil(time) - 1); });
  el("next").addEventListener("click", () => { play(false); seek(Math.floor(time) + 1); });
  for (const name of ["sheet", "beam", "goal", "machine"]) {
    const box = el("show-" + name);
    box.checked = show[name];
    box.addEventListener("change", () => { show[name] = box.checked; draw(); });
  }
  el("reset-view").addEventListener("click", () => { Object.assign(view, { turn: -0.6, tilt: 0.95, zoom: 1, shift: [0, 0] }); draw(); });
  const pointers = new Map();
  canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, e); });
  canvas.addEventListener("pointerup", (e) => pointers.delete(e.pointerId));
  canvas.addEventListener("pointercancel", (e) => pointers.delete(e.pointerId));
  canvas.addEventListener("pointermove", (e) => {
    const old = pointers.get(e.pointerId);
    if (!old) return;
    const dx = e.clientX - old.clientX, dy = e.clientY - old.clientY;
    if (pointers.size === 2) {
      const other = [...pointers.values()].find((p) => p.pointerId !== e.pointerId);
      const before = Math.hypot(old.clientX - other.clientX, old.clientY - other.clientY);
      const after = Math.hypot(e.clientX - other.clientX, e.clientY - other.clientY);
      if (before > 5) zoomBy(after / before);
    } else if (e.shiftKey || e.buttons === 2 || e.buttons === 4) {
      view.shift[0] += (2 * dx) / canvas.clientHeight / view.zoom; view.shift[1] -= (2 * dy) / canvas.clientHeight / view.zoom;
    } else {
      view.turn -= dx * 0.008; view.tilt = Math.max(0, Math.min(Math.PI, view.tilt - dy * 0.008));
    }
    pointers.set(e.pointerId, e);
    draw();
  });
  function zoomBy(factor) { view.zoom = Math.max(0.3, Math.min(20, view.zoom * factor)); }
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoomBy(Math.exp(-e.deltaY * 0.001)); draw(); }, { passive: false });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("keydown", (e) => {
    const moves = {
      ArrowLeft: () => (view.turn += 0.1), ArrowRight: () => (view.turn -= 0.1),
      ArrowUp: () => (view.tilt = Math.max(0, view.tilt - 0.1)), ArrowDown: () => (view.tilt = Math.min(Math.PI, view.tilt + 0.1)),
      "+": () => zoomBy(1.15), "-": () => zoomBy(1 / 1.15),
    };
    if (moves[e.key]) { e.preventDefault(); moves[e.key](); draw(); }
  });
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || /INPUT|SELECT|TEXTAREA|BUTTON|SUMMARY|A/.test(e.target.tagName) && e.target !== canvas) return;
    const keys = {
      " ": () => play(!playing), ".": () => seek(Math.floor(time) + 1), ",": () => seek(Math.ceil(time) - 1),
      Home: () => seek(0), End: () => seek(stepCount),
    };
    if (keys[e.key]) { e.preventDefault(); if (e.key !== " ") play(false); keys[e.key](); }
  });

  /* ---- links between table, net and view ---- */
  function pick(face) {
    picked = face === picked ? -1 : face;
    document.querySelectorAll("#net .picked").forEach((x) => x.classList.remove("picked"));
    if (picked >= 0) {
      const shape = document.querySelector('#net [data-face="' + picked + '"]');
      if (shape) shape.classList.add("picked");
      const crease = D.creaseOf[picked], angle = crease >= 0 ? D.wanted[crease] : null;
      el("picked-text").textContent = "face " + picked + (angle === null ? " (base face)" : ", crease " + crease + ": " + angle.toFixed(1) + "° wanted");
    } else el("picked-text").textContent = "";
    draw();
  }
  document.querySelectorAll("#net [data-face]").forEach((shape) => shape.addEventListener("click", () => pick(Number(shape.dataset.face))));
  document.querySelectorAll("#net [data-crease]").forEach((shape) => shape.addEventListener("click", () => {
    const crease = Number(shape.dataset.crease);
    jump(crease);
    pick(childOf[crease]);
  }));
  function jump(crease) {
    let found = -1;
    D.steps.forEach((s, i) => { if (s.op === "fold" && s.crease === crease) found = i; });
    if (found >= 0) { play(false); seek(found + 0.999); }
  }
  rows.forEach((row) => row.addEventListener("click", () => { play(false); seek(Number(row.dataset.step) + 0.999); }));
  document.querySelectorAll("[data-jump]").forEach((button) => button.addEventListener("click", () => {
    const crease = Number(button.dataset.jump);
    jump(crease);
    if (picked !== childOf[crease]) pick(childOf[crease]);
    canvas.scrollIntoView({ block: "center" });
  }));
  const marker = /[#&]t=([\d.]+)/.exec(location.hash);
  if (marker) time = Math.min(stepCount, Number(marker[1]));
  window.addEventListener("resize", draw);
  window.blossom = {
    seek: seek, steps: stepCount,
    corners: () => Array.from(cornersOf(motionsOf(stateAt(time).angle))),
  };
  draw();
  document.documentElement.dataset.ready = "1";
})();
