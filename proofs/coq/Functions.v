(* The functions of the statements that Coq's library lacks; nothing here is emitted. *)
From Coq Require Import Reals.
Open Scope R_scope.

Definition sigmoid (x : R) : R := 1 / (1 + exp (- x)).

(* the angle of the point (x, y), in (-PI, PI]; zero at the origin *)
Definition atan2 (y x : R) : R :=
  if Rlt_dec 0 x then atan (y / x)
  else if Rlt_dec x 0 then (if Rle_dec 0 y then atan (y / x) + PI else atan (y / x) - PI)
  else if Rlt_dec 0 y then PI / 2 else if Rlt_dec y 0 then - (PI / 2) else 0.

(* vectors of three numbers *)
Record vec := vector { first : R; second : R; third : R }.
Definition dot (a b : vec) : R := first a * first b + second a * second b + third a * third b.
Definition len (a : vec) : R := sqrt (dot a a).
Definition add (a b : vec) : vec := vector (first a + first b) (second a + second b) (third a + third b).
Definition scale (k : R) (a : vec) : vec := vector (k * first a) (k * second a) (k * third a).
