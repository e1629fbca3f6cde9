(* The plant in closed loop, whatever law pushes it: the equations of the outer and of the inner loop. *)
From Coq Require Import Reals.
Require Import Basics Functions Statements Geometry Inertia.
Open Scope R_scope.

(* what a name stands for *)
Ltac unfolded x := match goal with H : x = _ |- _ => rewrite H end.
Ltac parts := repeat match goal with H : _ /\ _ |- _ => destruct H end.

(* what a theorem says of the loop or plant at hand *)
Tactic Notation "said" constr(theorem) "of" hyp(P) "as" ident(x) :=
  let T := type of theorem in let T := eval red in T in
  let F := fresh in pose proof (theorem : T) as F; pose proof P as x; apply F in x; clear F.

Ltac not_zero := apply Rgt_not_eq; assumption.

Theorem thrust_holds : thrust.
Proof. unfold thrust. intros * P. unfold plant in P. parts. unfolded u. apply sqrt_pos. Qed.

Theorem turning_holds : turning.
Proof. unfold turning. intros * P. unfold plant in P. parts. unfolded e2. unfolded e3. apply T2_holds. Qed.

Theorem series_holds : series.
Proof.
  unfold series. intros * P. unfold plant in P. parts. unfolded bt1. unfolded bt2. unfolded bt3. unfolded bp2. unfolded bp3.
  unfolded e2. unfolded e3. apply T1_near_holds.
Qed.

Theorem no_series_holds : no_series.
Proof.
  unfold no_series. intros * P A B. unfold plant in P. parts. unfolded bt1. unfolded bt2. unfolded bt3. unfolded bp2. unfolded bp3.
  subst e2 e3. destruct (T1_holds theta phi z1 z2 A B) as [G1 [G2 G3]]. repeat split; apply Rminus_diag_eq; assumption.
Qed.

Theorem symmetric_holds : symmetric.
Proof.
  unfold symmetric. intros * P. unfold plant in P. parts.
  unfolded j12. unfolded j13. unfolded j21. unfolded j23. unfolded j31. unfolded j32. repeat split; ring.
Qed.

Theorem skew_holds : skew.
Proof.
  unfold skew. intros * P. unfold plant in P. parts.
  unfolded jd11. unfolded jd12. unfolded jd13. unfolded jd21. unfolded jd22. unfolded jd23. unfolded jd31. unfolded jd32. unfolded jd33.
  unfolded c11. unfolded c12. unfolded c13. unfolded c21. unfolded c22. unfolded c23. unfolded c31. unfolded c32. unfolded c33. apply T6_holds.
Qed.

Theorem gain_holds : gain.
Proof.
  unfold gain. intros * P. intros. unfold plant in P. parts.
  unfolded j11. unfolded j12. unfolded j13. unfolded j21. unfolded j22. unfolded j23. unfolded j31. unfolded j32. unfolded j33.
  apply T5_holds; assumption.
Qed.

Theorem outer_loop_holds : outer_loop.
Proof.
  unfold outer_loop. intros * P. unfold plant in P. parts.
  assert (I : u * - sin tilt1 = f1 /\ u * (cos tilt1 * sin tilt2) = f2 /\ u * (cos tilt1 * cos tilt2) = f3).
  { unfolded tilt1. unfolded tilt2. unfolded u. apply T17_holds. }
  destruct I as [I1 [I2 I3]]. rewrite I1, I2, I3. repeat split.
  - unfolded rad1. unfolded f1. unfolded ra1. field. apply Rgt_not_eq. assumption.
  - unfolded rad2. unfolded f2. unfolded ra2. field. apply Rgt_not_eq. assumption.
  - unfolded rad3. unfolded f3. unfolded ra3. field. apply Rgt_not_eq. assumption.
Qed.

Theorem inner_loop_holds : inner_loop.
Proof.
  unfold inner_loop. intros * P. pose proof symmetric_holds as Y. unfold symmetric in Y. pose proof P as P'. apply Y in P'.
  destruct P' as [_ [Y21 [Y31 [_ [_ [Y32 _]]]]]]. clear Y. unfold plant in P. parts.
  assert (D : j11 * (j22 * j33 - j23 * j23) - j12 * (j12 * j33 - j23 * j13) + j13 * (j12 * j23 - j22 * j13) <> 0).
  { assert (E : j11 * (j22 * j33 - j23 * j23) - j12 * (j12 * j33 - j23 * j13) + j13 * (j12 * j23 - j22 * j13)
      = s1 * s2 * s3 * (cos theta * cos theta)).
    { unfolded j11. unfolded j12. unfolded j13. unfolded j22. unfolded j23. unfolded j33. on_circles theta phi.
      match goal with |- ?t = _ => replace t with (s1 * s2 * s3 * (ct * ct) * ((sf * sf + cf * cf) * (sf * sf + cf * cf))) by ring end.
      rewrite F. ring. }
    rewrite E. repeat apply Rmult_integral_contrapositive_currified; try (apply Rgt_not_eq; assumption); assumption. }
  assert (S : j11 * acc1 + j12 * acc2 + j13 * acc3 = b1 - ct1 /\ j12 * acc1 + j22 * acc2 + j23 * acc3 = b2 - ct2
    /\ j13 * acc1 + j23 * acc2 + j33 * acc3 = b3 - ct3).
  { unfolded acc1. unfolded acc2. unfolded acc3. apply solved_holds. exact D. }
  assert (Q : c11 * q1 + c12 * q2 + c13 * q3 = ct1 /\ c21 * q1 + c22 * q2 + c23 * q3 = ct2 /\ c31 * q1 + c32 * q2 + c33 * q3 = ct3).
  { unfolded ct1. unfolded ct2. unfolded ct3. unfolded c11. unfolded c12. unfolded c13. unfolded c21. unfolded c22. unfolded c23.
    unfolded c31. unfolded c32. unfolded c33. apply C_rates_holds. }
  destruct S as [S1 [S2 S3]]. destruct Q as [Q1 [Q2 Q3]]. rewrite Y21, Y31, Y32, S1, S2, S3, Q1, Q2, Q3. repeat split; ring.
Qed.
