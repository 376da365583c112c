/** What a printer gets of the page: plots as wide as the paper, the view on a light ground. */

/** Give the plots a box of their size on the screen while the page is printed: they are scaled by it, not cut off. */
export function printsPlots(): void {
  const plots = () => document.querySelectorAll<SVGSVGElement>(".cl-figure .main-svg");
  addEventListener("beforeprint", () => plots().forEach((plot) => {
    plot.setAttribute("viewBox", `0 0 ${plot.width.baseVal.value} ${plot.height.baseVal.value}`);
  }));
  addEventListener("afterprint", () => plots().forEach((plot) => plot.removeAttribute("viewBox")));
}

/** Whether what is drawn now is for a dark screen. */
export function darkNow(): boolean {
  return document.body.classList.contains("body--dark") && !printing;
}

/** Call when a print begins (true) and when it has ended. */
export function onPrint(act: (now: boolean) => void): void {
  for (const [name, now] of [["beforeprint", true], ["afterprint", false]] as [string, boolean][]) {
    addEventListener(name, () => { printing = now; act(now); });
  }
}

let printing = false;
