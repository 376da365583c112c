/** Two views that move together: from the same side, at the same time or where their paths belong to one another. */

export type Abscissa = "time" | "path";

/** The other view, and rising times or lengths of path that belong together; none in the view that is led. */
export interface Pair<View> { other: View; against: Abscissa; here: number[]; there: number[] }

/** Value that belongs to x where rising `here` and `there` belong together; straight between, the ends beyond. */
export function between(here: number[], there: number[], x: number): number {
  let k = 1;
  while (k < here.length - 1 && here[k] < x) k++;
  const a = here[k - 1], b = here[k], f = b > a ? Math.min(Math.max((x - a) / (b - a), 0), 1) : 0;
  return there[k - 1] + f * (there[k] - there[k - 1]);
}
