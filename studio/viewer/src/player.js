// Slider, step, play and speed. Time is counted in steps of the plan.

const PACE = { fold: 1.2, rotate: 1.2, cut: 0.7, wait: 6, clip: 1.0, bend: 1.0, release: 0.6 };
const CALM_STEPS_S = 1.5;
const NEAR = 0.0015; // a jump to a step ends just before its end

const el = (id) => document.getElementById(id);

export class Player {
  /** `shown(time)` draws a moment. */
  constructor(timeline, shown) {
    this.timeline = timeline;
    this.shown = shown;
    this.time = timeline.length;
    this.playing = false;
    this.slider = el("time");
    this.slider.max = timeline.length;
    this.calm = window.matchMedia("(prefers-reduced-motion: reduce)");
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.slider.addEventListener("keydown", (event) => this.key(event, {
      ArrowLeft: () => this.step(-1), ArrowDown: () => this.step(-1),
      ArrowRight: () => this.step(1), ArrowUp: () => this.step(1),
    }));
    el("play").addEventListener("click", () => this.play(!this.playing));
    el("previous").addEventListener("click", () => this.step(-1));
    el("next").addEventListener("click", () => this.step(1));
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const typing = event.target.closest("select, textarea, summary, a, button, input:not([type=range])");
      if (typing && event.key === " ") return;
      if (event.target.closest("select, textarea")) return;
      this.key(event, {
        " ": () => this.play(!this.playing), ".": () => this.step(1), ",": () => this.step(-1),
        Home: () => this.seek(0), End: () => this.seek(timeline.length),
        PageDown: () => this.step(10), PageUp: () => this.step(-10),
      });
    });
  }

  key(event, keys) {
    if (!keys[event.key]) return;
    event.preventDefault();
    event.stopPropagation();
    keys[event.key]();
  }

  seek(time) {
    this.play(false);
    this.go(time);
  }

  step(by) {
    const now = by > 0 ? Math.floor(this.time + NEAR) : Math.ceil(this.time - NEAR);
    this.seek(now + by);
  }

  go(time) {
    this.time = Math.max(0, Math.min(this.timeline.length, time));
    this.slider.value = this.time;
    this.shown(this.time);
  }

  play(on) {
    if (on === this.playing) return;
    this.playing = on;
    el("play").textContent = on ? "❚❚" : "▶";
    el("play").setAttribute("aria-label", on ? "pause" : "play");
    if (!on) return;
    if (this.time >= this.timeline.length) this.go(0);
    this.last = undefined;
    this.owed = 0;
    requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    const passed = this.last === undefined ? 0 : Math.min((now - this.last) / 1000, 0.1);
    this.last = now;
    const speed = Number(el("speed").value);
    if (this.calm.matches) {
      // Whole steps, one after the other: nothing on the page moves in between.
      this.owed += passed * CALM_STEPS_S * speed;
      const steps = Math.floor(this.owed);
      this.owed -= steps;
      if (steps > 0) this.go(Math.floor(this.time + 1e-9) + steps);
    } else if (passed > 0) {
      const step = this.timeline.steps[Math.min(Math.floor(this.time), this.timeline.length - 1)];
      this.go(this.time + passed * (PACE[step?.op] ?? 1) * speed);
    }
    if (this.time >= this.timeline.length) this.play(false);
    else requestAnimationFrame((later) => this.tick(later));
  }
}
