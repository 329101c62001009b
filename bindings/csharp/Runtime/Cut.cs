namespace Palpate {
  /// <summary>A blade after a touch, in the world: force, N, and torque, N m, on it, about the first of its points.</summary>
  public struct BladeState {
    public Vector Force, Torque;
    /// <summary>Since it came: J that cutting and that friction on its flanks have taken from it; m^2 that its edge has swept in tissue, where it feels it.</summary>
    public double Work, FrictionWork, Area;
    /// <summary>Of its points: that are in the region that may be cut; that cut in this touch.</summary>
    public int InTissue, Cuts;
  }

  /// <summary>What has been cut, after a touch.</summary>
  public struct CutState {
    /// <summary>Goes up where the surface has changed: Scene.CutSurface is to be drawn anew.</summary>
    public ulong Surface;
    /// <summary>m^2, at rest: of the faces that are cut, each once.</summary>
    public double Area;
    /// <summary>Faces that are cut, tetrahedra that are removed, new nodes, pieces of the organ.</summary>
    public int Faces, Removed, Nodes, Pieces;
    /// <summary>Faces that a blade has met and that cannot be cut yet; changes that the compliance does not have yet; rank of what cuts add.</summary>
    public int Waiting, Left, Rank;
    /// <summary>There are no nodes or no rank left, and nothing more is cut.</summary>
    public bool IsFull;
    /// <summary>How often the compliance was re-based; it is being re-based.</summary>
    public int Rebased;
    public bool Rebasing;
  }
}
