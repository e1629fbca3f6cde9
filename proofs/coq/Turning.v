(* How fast the inversion's angles turn: T15. *)
From Coq Require Import Reals Lra Psatz.
Require Import Functions Statements.
Open Scope R_scope.

Lemma squares_positive : forall y z, 0 < z -> 0 < y * y + z * z.
Proof. intros. pose proof (Rle_0_sqr y). unfold Rsqr in *. nra. Qed.

(* s: the root; b: its square's rate by the chain rule *)
Lemma turned : forall x y z g1 g2 g3 s, 0 < z -> 0 < s -> s * s = y * y + z * z ->
  let p := (y * g2 + z * g3) / s in let th := (- g1 * s + p * x) / (x * x + s * s) in let ph := (g2 * z - g3 * y) / (s * s) in
  (th * th + ph * ph) * (y * y + z * z) <= g1 * g1 + g2 * g2 + g3 * g3.
Proof.
  intros x y z g1 g2 g3 s Z S E p th ph. assert (B : 0 < s * s) by nra. assert (D : 0 < x * x + s * s) by (pose proof (Rle_0_sqr x); unfold Rsqr in *; lra).
  assert (P : p * p + ph * ph * (s * s) = g2 * g2 + g3 * g3).
  { assert (P1 : p * s = y * g2 + z * g3) by (unfold p; field; lra). assert (P2 : ph * (s * s) = g2 * z - g3 * y) by (unfold ph; field; lra).
    apply Rmult_eq_reg_r with (s * s); [| lra]. transitivity ((p * s) * (p * s) + (ph * (s * s)) * (ph * (s * s))); [ring |].
    rewrite P1, P2, E. ring. }
  assert (C : th * (x * x + s * s) = - g1 * s + p * x) by (unfold th; field; lra).
  assert (T : th * th * (s * s) <= g1 * g1 + p * p).
  { apply Rmult_le_reg_r with (x * x + s * s); [exact D |].
    assert (Q : (th * (x * x + s * s)) * (th * (x * x + s * s)) <= (g1 * g1 + p * p) * (x * x + s * s)).
    { rewrite C. pose proof (Rle_0_sqr (g1 * x + p * s)) as R. unfold Rsqr in R. lra. }
    assert (N : 0 <= th * th * (x * x) * (x * x + s * s)).
    { apply Rmult_le_pos; [| lra]. pose proof (Rle_0_sqr (th * x)) as R. unfold Rsqr in R. lra. }
    lra. }
  rewrite <- E. lra.
Qed.

Theorem T15_holds : T15.
Proof.
  unfold T15. intros f1 f2 f3 t g1 g2 g3 Z D1 D2 D3.
  assert (B : forall x, 0 < f2 x * f2 x + f3 x * f3 x) by (intro; apply squares_positive; apply Z).
  assert (S : forall x, 0 < sqrt (f2 x * f2 x + f3 x * f3 x)) by (intro; apply sqrt_lt_R0; apply B).
  assert (U : forall x, 0 < sqrt (f1 x * f1 x + sqrt (f2 x * f2 x + f3 x * f3 x) * sqrt (f2 x * f2 x + f3 x * f3 x))).
  { intro x. apply sqrt_lt_R0. apply squares_positive. apply S. }
  set (s := sqrt (f2 t * f2 t + f3 t * f3 t)). assert (SP : 0 < s) by apply S.
  assert (E : s * s = f2 t * f2 t + f3 t * f3 t) by (apply sqrt_sqrt; pose proof (B t); lra).
  assert (DS : derivable_pt_lim (fun x => sqrt (f2 x * f2 x + f3 x * f3 x)) t ((f2 t * g2 + f3 t * g3) / s)).
  { replace ((f2 t * g2 + f3 t * g3) / s) with (/ (2 * sqrt (f2 t * f2 t + f3 t * f3 t)) * ((g2 * f2 t + f2 t * g2) + (g3 * f3 t + f3 t * g3))) by (fold s; field; lra).
    apply (derivable_pt_lim_comp (fun x => f2 x * f2 x + f3 x * f3 x) sqrt).
    - apply (derivable_pt_lim_plus (fun x => f2 x * f2 x) (fun x => f3 x * f3 x)); [apply (derivable_pt_lim_mult f2 f2) | apply (derivable_pt_lim_mult f3 f3)]; assumption.
    - apply derivable_pt_lim_sqrt. apply B. }
  exists ((- g1 * s + (f2 t * g2 + f3 t * g3) / s * f1 t) / (f1 t * f1 t + s * s)), ((g2 * f3 t - g3 * f2 t) / (s * s)). split; [| split].
  - apply derivable_pt_lim_ext with (f := comp atan ((- f1) / (fun x => sqrt (f2 x * f2 x + f3 x * f3 x)))%F).
    + intro x. unfold comp, div_fct, opp_fct, atan2. destruct (Rgt_dec _ 0) as [_ | N]; [| exfalso; apply N; apply U].
      destruct (Rlt_dec 0 _) as [_ | N]; [reflexivity | exfalso; apply N; apply S].
    + match goal with |- derivable_pt_lim _ _ ?r => replace r with (/ (1 + (- f1 t / s) ^ 2) * ((- g1 * s - (f2 t * g2 + f3 t * g3) / s * - f1 t) / Rsqr s)) end.
      * apply derivable_pt_lim_comp; [| apply derivable_pt_lim_atan].
        apply (derivable_pt_lim_div (- f1)%F (fun x => sqrt (f2 x * f2 x + f3 x * f3 x)) t (- g1)); [apply derivable_pt_lim_opp; exact D1 | exact DS | fold s; lra].
      * unfold Rsqr. pose proof (squares_positive (f1 t) s SP). field. repeat split; lra.
  - apply derivable_pt_lim_ext with (f := comp atan (f2 / f3)%F).
    + intro x. unfold comp, div_fct, atan2. destruct (Rgt_dec _ 0) as [_ | N]; [| exfalso; apply N; apply S].
      destruct (Rlt_dec 0 _) as [_ | N]; [reflexivity | exfalso; apply N; apply Z].
    + pose proof (Z t) as ZT. pose proof (B t) as BT.
      match goal with |- derivable_pt_lim _ _ ?r => replace r with (/ (1 + (f2 t / f3 t) ^ 2) * ((g2 * f3 t - g3 * f2 t) / Rsqr (f3 t))) end.
      * apply derivable_pt_lim_comp; [| apply derivable_pt_lim_atan]. apply derivable_pt_lim_div; [assumption | assumption | lra].
      * rewrite E. unfold Rsqr. field. repeat split; nra.
  - apply turned; [apply Z | exact SP | exact E].
Qed.
