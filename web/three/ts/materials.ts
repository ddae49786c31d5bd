import type { Material } from 'three';

interface Held {
  material: Material;
  users: number;
}

/** Materials of the model, each once, however many files have it. */
export class Materials {
  private readonly held = new Map<string, Held>();

  /** What tells a material apart. `file`: that it came with. */
  static key(material: Material, file: string): string {
    const number = material.userData['enfilade'] as unknown;
    const { flatShading, vertexColors } = material as Material & { flatShading?: boolean };
    const name = typeof number === 'number' ? `${number}` : `${file} ${material.name} ${material.uuid}`;
    return `${name} ${flatShading} ${vertexColors}`;
  }

  /** Takes a material for one more user, and gives the one to use. */
  take(key: string, material: Material): Material {
    const held = this.held.get(key);
    if (held) {
      held.users++;
      return held.material;
    }
    this.held.set(key, { material, users: 1 });
    return material;
  }

  /** One user less. */
  letGo(key: string): void {
    const held = this.held.get(key);
    if (!held || --held.users > 0) return;
    this.held.delete(key);
    for (const value of Object.values(held.material) as unknown[]) {
      if ((value as { isTexture?: boolean } | null)?.isTexture) (value as { dispose(): void }).dispose();
    }
    held.material.dispose();
  }
}
