// A flat-ended pin on a disc that turns about z: the pin, and the part of the disc around it. Structured hexahedra.
//
// Lengths in mm; the pin's axis stands at x = track_radius, z up from the contact. Both meshes match at the contact.
// Physical groups: every name starts with the body it belongs to, punch_ (the pin) or strip_ (the disc).

DefineConstant[
  pin_radius = 3,
  pin_height = 12,
  track_radius = 15,      // of the pin's axis from the disc's
  disc_height = 6,
  disc_radius = 10,       // of the part of the disc that is meshed, about the pin's axis
  core = 0.5,             // half the diagonal of the square in the pin's middle, over its radius
  around = 4,             // elements over each quarter of the pin's edge
  across = 3,             // elements between the square and the edge
  edge_grading = 2,       // of an element's width near the square over that at the edge
  outer = 3,              // elements between the pin's edge and the end of the disc's part
  spread = 2,             // of such an element's width over that of its neighbour towards the pin
  pin_layers = 5,         // elements over the height
  disc_layers = 4,
  growth = 1.8,           // of an element's height over that of its neighbour towards the contact
  diffusion_area = 0      // diffusivity over the angular speed of a strip that turns, mm²/rad; 0: not known
];

If(diffusion_area < 0)
  Error("diffusion_area must not be negative");
EndIf
If(pin_radius <= 0 || pin_height <= 0 || disc_height <= 0 || disc_radius <= pin_radius || track_radius < 0)
  Error("lengths must be positive, disc_radius larger than pin_radius");
EndIf
If(core <= 0 || core >= 0.9)
  Error("core must lie between 0 and 0.9");
EndIf
If(around < 1 || across < 1 || outer < 1 || pin_layers < 1 || disc_layers < 1)
  Error("around, across, outer, pin_layers and disc_layers must be at least 1");
EndIf
If(growth <= 0 || spread <= 0 || edge_grading <= 0)
  Error("growth, spread and edge_grading must be positive");
EndIf

// At the strip's surface elements are at most as high as the layer that heats up while it passes.
turned = Pi; // the angle under the pin; both branches of a ? : are evaluated, a 1 / 0 in either is an error
If(track_radius > pin_radius)
  turned = 2 * pin_radius / track_radius;
EndIf
layer = Sqrt(diffusion_area * turned);
whole = 0;
For i In {0 : disc_layers - 1}
  whole += growth^i;
EndFor
top_growth = growth;
If(layer > 0 && disc_height / whole > layer)
  top_growth = (growth > 1.5) ? growth : 1.5;
  top_count = Ceil(Log(1 + (top_growth - 1) * disc_height / layer) / Log(top_growth));
  disc_layers = (top_count > disc_layers) ? top_count : disc_layers;
EndIf
growths[] = {growth, top_growth};

heights[] = {pin_height, -disc_height};
layers[] = {pin_layers, disc_layers};
radii[] = {core * pin_radius, pin_radius, disc_radius};
// The plane of the contact is meshed once and extruded both ways: its surfaces belong to both bodies.
o = newp; Point(o) = {track_radius, 0, 0};
p[] = {}; ring[] = {}; spoke[] = {};
For i In {0 : 2}
  For k In {0 : 3}
    angle = Pi / 4 + k * Pi / 2;
    n = newp; Point(n) = {track_radius + radii[i] * Cos(angle), radii[i] * Sin(angle), 0};
    p[] += n;
  EndFor
EndFor
For i In {0 : 2}
  For k In {0 : 3}
    l = newl;
    If(i == 0)
      Line(l) = {p[k], p[(k + 1) % 4]};
    Else
      Circle(l) = {p[4 * i + k], o, p[4 * i + (k + 1) % 4]};
    EndIf
    Transfinite Curve{l} = around + 1;
    ring[] += l;
    If(i > 0)
      l = newl; Line(l) = {p[4 * (i - 1) + k], p[4 * i + k]};
      If(i == 1)
        Transfinite Curve{l} = across + 1 Using Progression edge_grading^(-1 / across);
      Else
        Transfinite Curve{l} = outer + 1 Using Progression spread;
      EndIf
      spoke[] += l;
    EndIf
  EndFor
EndFor
n = newll; Curve Loop(n) = {ring[{0 : 3}]};
s = news; Plane Surface(s) = {n};
faces[] = {s};
For i In {1 : 2}
  For k In {0 : 3}
    n = newll;
    Curve Loop(n) = {ring[4 * i + k], -spoke[4 * (i - 1) + (k + 1) % 4], -ring[4 * (i - 1) + k], spoke[4 * (i - 1) + k]};
    s = news; Plane Surface(s) = {n};
    faces[] += s;
  EndFor
EndFor
Transfinite Surface{faces[]};
Recombine Surface{faces[]};

For body In {0 : 1}
  ones[] = {}; levels[] = {}; level = 0; height = 1; whole = 0;
  For i In {1 : layers[body]}
    whole += height; height *= growths[body];
  EndFor
  height = 1;
  For i In {1 : layers[body]}
    level += height / whole; height *= growths[body];
    ones[] += 1; levels[] += level;
  EndFor
  last = 4 * (1 + body);
  made[] = Extrude {0, 0, heights[body]} { Surface{faces[{0 : last}]}; Layers{ones[], levels[]}; Recombine; };
  volumes~{body}[] = {}; far~{body}[] = {}; sides~{body}[] = {};
  For i In {0 : last}
    far~{body}[] += made[6 * i]; volumes~{body}[] += made[6 * i + 1];
    If(i > last - 4)    // the outermost ring, whose arcs come first
      sides~{body}[] += made[6 * i + 2];
    EndIf
  EndFor
EndFor

Physical Volume("punch_body") = volumes_0[];
Physical Surface("punch_contact") = {faces[{0 : 4}]};
Physical Surface("punch_top") = far_0[];
Physical Surface("punch_sides") = sides_0[];
Physical Volume("strip_body") = volumes_1[];
Physical Surface("strip_contact") = {faces[{0 : 4}]};
Physical Surface("strip_free") = {faces[{5 : 8}]};
Physical Surface("strip_bottom") = far_1[];
Physical Surface("strip_sides") = sides_1[];
