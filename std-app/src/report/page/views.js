// Linked views: all show the same part of the picture, and mark the same pixel.

// Device pixels of a pixel at the largest zoom.
const MAX_MAGNIFICATION = 64;

// Steps of a key: factor of the zoom, and fraction of the visible part.
const ZOOM_STEP = Math.SQRT2;
const PAN_STEP = 0.15;

// Logarithm of the zoom for a pixel of the wheel, and the factor for a pinch on a touch pad.
const WHEEL_SPEED = 0.002;
const PINCH_SPEED = 4;

// Milliseconds after a scroll of the page in which the wheel still scrolls.
const SCROLLING = 250;

// Part of the picture that all views show: zoom over the fitted size, and the centre from 0 to 1.
class Camera extends EventTarget {
  constructor(width, height) {
    super();
    Object.assign(this, { width, height, zoom: 1, x: 0.5, y: 0.5, pixel: null, views: [], scrolled: -Infinity });
    addEventListener("scroll", () => { this.scrolled = performance.now(); }, { passive: true });
  }

  // Device pixels of a pixel in the first view at zoom 1.
  get fitted() {
    return ((this.views[0]?.box.clientWidth || this.width) * devicePixelRatio) / this.width;
  }

  get magnification() {
    return this.zoom * this.fitted;
  }

  // Zooms about a point of the picture, which stays where it is in the views.
  zoomTo(zoom, [x, y] = [this.x, this.y]) {
    const [least, most] = [Math.min(1, 1 / this.fitted), Math.max(1, MAX_MAGNIFICATION / this.fitted)];
    const next = Math.min(most, Math.max(least, zoom));
    const kept = this.zoom / next;
    this.moveTo(x + (this.x - x) * kept, y + (this.y - y) * kept, next);
  }

  moveTo(x, y, zoom = this.zoom) {
    const within = (at) => (zoom <= 1 ? 0.5 : Math.min(1 - 0.5 / zoom, Math.max(0.5 / zoom, at)));
    Object.assign(this, { zoom, x: within(x), y: within(y) });
    this.changed();
  }

  // Marks a pixel of the picture, and shows it if `follow`.
  point(column, row, follow = false) {
    const clamped = (at, size) => Math.min(size - 1, Math.max(0, Math.floor(at)));
    this.pixel = [clamped(column, this.width), clamped(row, this.height)];
    if (follow) {
      const into = (at, centre) => Math.min(at + 0.45 / this.zoom, Math.max(at - 0.45 / this.zoom, centre));
      const [x, y] = this.centre();
      this.moveTo(into(x, this.x), into(y, this.y));
    } else {
      this.changed();
    }
  }

  // Centre of the marked pixel, from 0 to 1.
  centre() {
    return [(this.pixel[0] + 0.5) / this.width, (this.pixel[1] + 0.5) / this.height];
  }

  changed() {
    this.views.forEach((view) => view.update());
    this.dispatchEvent(new Event("change"));
  }

  // Acts on a key of a view; true if it has a meaning.
  key({ key, shiftKey }, inView) {
    const zooms = { "+": ZOOM_STEP, "=": ZOOM_STEP, "-": 1 / ZOOM_STEP, _: 1 / ZOOM_STEP, "−": 1 / ZOOM_STEP };
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
    if (key in zooms) this.zoomTo(this.zoom * zooms[key]);
    else if (key === "0") this.zoomTo(1);
    else if (key === "1") this.zoomTo(1 / this.fitted);
    else if (arrow && inView && shiftKey) {
      const [column, row] = this.pixel ?? [this.x * this.width, this.y * this.height];
      this.point(column + arrow[0], row + arrow[1], true);
    } else if (arrow && inView) {
      this.moveTo(this.x + (arrow[0] * PAN_STEP) / this.zoom, this.y + (arrow[1] * PAN_STEP) / this.zoom);
      this.point(this.x * this.width, this.y * this.height);
    } else return false;
    return true;
  }
}

// Picture in a box of the aspect of the whole.
class View {
  constructor(camera, label, takesWheel = false) {
    this.camera = camera;
    this.takesWheel = takesWheel;
    this.mark = el("div", { class: "mark", hidden: "" });
    this.panes = [this.pane()];
    const role = { role: "application", "aria-roledescription": "zoomable picture", "aria-label": label };
    this.box = el("div", { class: "view", tabindex: 0, ...role }, this.panes[0].element, this.mark);
    this.box.style.aspectRatio = `${camera.width} / ${camera.height}`;
    camera.views.push(this);
    new ResizeObserver(() => this.update()).observe(this.box);
    this.listen();
  }

  pane() {
    const canvas = el("canvas");
    return { canvas, element: el("div", { class: "pane" }, canvas) };
  }

  // Shows a layer in a pane: 0 is below, 1 is over it.
  show(layer, gain, index = 0) {
    const pane = this.panes[index];
    const { canvas } = pane;
    const painted = layer.canvas(gain);
    if (canvas.width !== layer.width || canvas.height !== layer.height) {
      Object.assign(canvas, { width: layer.width, height: layer.height });
    }
    canvas.getContext("2d").drawImage(painted, 0, 0);
    pane.layer = layer;
    this.update();
  }

  update() {
    const { zoom, x, y, width, height, pixel } = this.camera;
    const scale = (this.box.clientWidth * zoom * devicePixelRatio) / width;
    for (const { canvas, layer } of this.panes) {
      if (!layer) continue;
      const [across, down] = [layer.covers[0] / width, layer.covers[1] / height];
      Object.assign(canvas.style, { width: `${100 * across}%`, height: `${100 * down}%` });
      // Percentages of the canvas, so that views of all sizes agree.
      canvas.style.transform =
        `translate(${(100 * (0.5 - x * zoom)) / across}%, ${(100 * (0.5 - y * zoom)) / down}%) scale(${zoom})`;
      canvas.classList.toggle("pixelated", (scale * layer.covers[0]) / layer.width >= 1);
    }
    // Under the pointer a mark would hide what it marks, unless pixels are large.
    this.mark.hidden = !pixel || (this.isHovered && scale / devicePixelRatio < 6);
    if (pixel) {
      Object.assign(this.mark.style, {
        left: `${100 * (0.5 + (pixel[0] / width - x) * zoom)}%`, width: `${(100 * zoom) / width}%`,
        top: `${100 * (0.5 + (pixel[1] / height - y) * zoom)}%`, height: `${(100 * zoom) / height}%`,
      });
    }
    this.box.style.touchAction = zoom > 1 ? "none" : "pan-y";
    this.box.classList.toggle("zoomed", zoom > 1);
  }

  // Point of the picture at a point of the window, from 0 to 1.
  under({ clientX, clientY }) {
    const { left, top, width, height } = this.box.getBoundingClientRect();
    const { zoom, x, y } = this.camera;
    return [x + ((clientX - left) / width - 0.5) / zoom, y + ((clientY - top) / height - 0.5) / zoom];
  }

  listen() {
    const { box, camera } = this;
    const touches = new Map();
    box.addEventListener("wheel", (event) => {
      const wanted = this.takesWheel || event.ctrlKey || document.activeElement === box;
      if (!wanted || (performance.now() - camera.scrolled < SCROLLING && !event.ctrlKey)) return;
      const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
      const speed = WHEEL_SPEED * (event.ctrlKey ? PINCH_SPEED : 1);
      const before = camera.zoom;
      camera.zoomTo(camera.zoom * Math.exp(-speed * lines * event.deltaY), this.under(event));
      // At the ends of the zoom the page scrolls.
      if (camera.zoom !== before || event.ctrlKey) event.preventDefault();
    }, { passive: false });
    box.addEventListener("pointerdown", (event) => {
      touches.set(event.pointerId, this.under(event));
      if (camera.zoom > 1 || touches.size > 1) box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointermove", (event) => {
      const at = this.under(event);
      if (touches.size === 2 && touches.has(event.pointerId)) this.pinch(touches, event.pointerId, at);
      else if (touches.has(event.pointerId) && camera.zoom > 1) {
        const from = touches.get(event.pointerId);
        camera.moveTo(camera.x + from[0] - at[0], camera.y + from[1] - at[1]);
      }
      this.isHovered = event.pointerType === "mouse" || event.pointerType === "";
      const [x, y] = this.under(event);
      camera.point(x * camera.width, y * camera.height);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      box.addEventListener(end, (event) => touches.delete(event.pointerId));
    }
    box.addEventListener("pointerleave", (event) => {
      touches.delete(event.pointerId);
      this.isHovered = false;
      this.update();
    });
    box.addEventListener("dblclick", (event) => camera.zoomTo(camera.zoom * 2, this.under(event)));
  }

  // Zooms so that both fingers keep their points of the picture.
  pinch(touches, id, at) {
    const { camera } = this;
    const [other] = [...touches].filter(([pointer]) => pointer !== id).map(([, point]) => point);
    const aspect = camera.height / camera.width;
    const distance = (a, b) => Math.hypot(a[0] - b[0], (a[1] - b[1]) * aspect);
    const factor = distance(at, other) / Math.max(1e-6, distance(touches.get(id), other));
    camera.zoomTo(camera.zoom * factor, other);
  }
}
