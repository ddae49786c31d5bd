export { Building, hash, type ObjectFacts, type Portal, type PortalKind } from './building.js';
export type { Box, Point } from './memory.js';
export { Movers, View, type Counts, type Mode } from './view.js';
export { Paths, Prefetch, type Path, type Step } from './ways.js';
