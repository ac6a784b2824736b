// A seed for scene_fuzz: every keyword of the native renderer's reader once, in less than 4 kB.
#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 4 adc_bailout 0.01 ambient_light rgb <1, 1, 0.9> }
#declare W = 1.5; #local P = <0.2, -0.5, 3>;
#macro Block(A, B) box { <A, B, A>, <A + 1, B + 1, A + 1> texture { pigment { rgb <0.5, A / 5, 0.2> } finish { diffuse 0.7 } } } #end
#declare S = seed(7);
#declare T = texture { pigment { bozo color_map { [0 rgb 0.1] [0.6 rgb <1, 0.5, 0>] [1 rgb 1] } turbulence 0.3 octaves 3 lambda 2 omega 0.4 scale 0.4 } finish { ambient 0.2 emission 0.1 diffuse 0.6 brilliance 1.5 specular 0.3 roughness 0.02 } }
#for (I, 0, 2) Block(I, -1) #end
#while (W > 0) sphere { <W, 1, 2 * rand(S)>, 0.3 texture { T } no_shadow } #declare W = W - 0.5; #end
#if (W = 0) cylinder { 0, y, 0.4 open pigment { checker rgb 1 rgb 0 scale 0.2 } } #else cone { 0, 1, y, 0 } #end
#ifdef (Q) plane { y, 0 } #end
#switch (2) #case (1) torus { 1, 0.2 } #break #range (1.5, 3) torus { 1, 0.3 pigment { gradient y frequency 3 phase 0.2 sine_wave } } #break #else disc { 0, y, 2 } #end
difference { box { -1, 1 } sphere { 0, 1.2 inverse } cylinder { -2 * y, 2 * y, 0.5 } pigment { brick rgb 0.4 rgb <0.6, 0.2, 0.1> brick_size <0.4, 0.1, 0.2> mortar 0.02 } rotate <10, 20, 30> translate 3 * x }
intersection { quadric { <1, 0, 1>, <0, 0, 0>, <0, 0, 0>, -1 } plane { y, 1 } plane { -y, 1 } pigment { wood triangle_wave } clipped_by { box { -2, 2 } } bounded_by { sphere { 0, 3 } } }
merge { prism { linear_spline linear_sweep -1, 1, 5, <0, 0>, <1, 0>, <1, 1>, <0, 1>, <0, 0> } polygon { 4, <0, 0>, <1, 0>, <0, 1>, <0, 0> } pigment { cells } }
union { //*PMName robot
  sphere { 0, 0.5 } disc { y, y, 1, 0.4 no_image no_reflection } object { Block(0.5, 0.5) }
  pigment { boxed pigment_map { [0 radial frequency 4] [1 colour rgb 0.3] } warp { repeat x * 0.5 offset y * 0.1 flip z } warp { turbulence 0.2 } }
  finish { reflection { 0.6 } phong 0.4 phong_size 30 metallic } matrix <1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.1, 0> transform { Twocone_X0 } }
light_source { <3, 5, -4> rgb 0.8 spotlight point_at P radius 20 falloff 40 tightness 2 fade_distance 5 fade_power 2 }
light_source { <-3, 5, -4>, rgb <0.3, vlength(P) / 9, 0.3> shadowless }
background { rgb 0.1 } sky_sphere { pigment { gradient y scale 2 translate -1 } }
camera { //*PMName lower
  location <0, 2, -6> right 1.33 * x up y angle 50 sky y look_at <0, 0.5, abs(-0.5)> }
