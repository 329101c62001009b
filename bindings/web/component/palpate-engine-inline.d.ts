// component.config.js writes this module.
declare const engine: string;
export default engine;
