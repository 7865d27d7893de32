// SPDX-License-Identifier: Apache-2.0
// A button that moves an axis as long as it is held. Whatever lets it go ends the motion: the
// pointer that leaves it or is lifted, a second pointer, the focus that goes elsewhere, the page
// that is hidden or closed. The server stops the axis by itself when the requests stay away.

const AGAIN_MS = 100;
const held = new Set();

/** Lets go of all buttons. */
export function releaseAll() {
  for (const one of [...held]) one.release();
}

window.addEventListener("blur", releaseAll);
window.addEventListener("pagehide", releaseAll);
document.addEventListener("visibilitychange", releaseAll);
document.addEventListener("pointerdown", (event) => event.isPrimary || releaseAll(), true);

export class Hold {
  /** `begin`, `again` and `end` send the requests, and return promises; `failed` gets an error. */
  constructor(button, { begin, again, end, failed }) {
    Object.assign(this, { button, begin, again, end, failed });
    this.timer = 0;
    this.ending = Promise.resolve(); // a motion begins only after the stop before it
    const release = () => this.release();
    for (const name of ["pointerup", "pointercancel", "pointerleave", "blur"]) {
      button.addEventListener(name, release);
    }
    button.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !event.isPrimary) return;
      // a touch is captured by itself, and would not be seen to leave
      if (button.hasPointerCapture(event.pointerId)) button.releasePointerCapture(event.pointerId);
      this.press();
    });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    button.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) this.press();
    });
    button.addEventListener("keyup", (event) => event.key === "Enter" && this.release());
  }

  get isHeld() {
    return held.has(this);
  }

  async press() {
    if (this.isHeld || this.button.disabled) return;
    releaseAll();
    held.add(this);
    this.button.setAttribute("aria-pressed", "true");
    const press = (this.pressed = Symbol("press"));
    await this.ending;
    if (this.pressed !== press || !this.isHeld) return; // let go in the meantime
    const over = (error) => {
      // refused, or ended by the server: nothing is left to be stopped
      if (this.pressed === press && this.letGo()) this.failed(error);
    };
    this.begin().catch(over);
    this.timer = setInterval(() => this.again().catch(over), AGAIN_MS);
  }

  /** Let go by the person: the motion has to end. */
  release() {
    const begun = this.timer !== 0;
    if (this.letGo() && begun) this.ending = this.end().catch(this.failed);
  }

  /** Asks for no more motion; returns whether the button was held. */
  letGo() {
    if (!held.delete(this)) return false;
    this.pressed = null;
    this.button.setAttribute("aria-pressed", "false");
    clearInterval(this.timer);
    this.timer = 0;
    return true;
  }
}
