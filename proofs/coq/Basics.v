(* Facts of analysis and algebra that the proofs share; nothing here is emitted. *)
From Coq Require Import Reals Lra Psatz.
Open Scope R_scope.

Lemma circle : forall x, sin x * sin x + cos x * cos x = 1.
Proof. intro x. pose proof (sin2_cos2 x) as H. unfold Rsqr in H. exact H. Qed.

Lemma sine_bounds : forall x, -1 <= sin x <= 1.
Proof. exact SIN_bound. Qed.

Lemma cosine_bounds : forall x, -1 <= cos x <= 1.
Proof. exact COS_bound. Qed.

(* sin x <= x and both signs: |sin x| <= |x| *)
Lemma sine_square : forall x, sin x * sin x <= x * x.
Proof.
  assert (P : forall x, 0 <= x -> sin x * sin x <= x * x).
  { intros x [H | <-].
    - destruct (Rle_dec x 1) as [L | G].
      + pose proof (sin_lt_x x H). assert (0 < sin x) by (apply sin_gt_0; pose proof PI2_1; lra). nra.
      + pose proof (SIN_bound x). nra.
    - rewrite sin_0. lra. }
  intro x. destruct (Rle_dec 0 x) as [H | H]; [auto |].
  pose proof (P (- x) ltac:(lra)) as Q. rewrite sin_neg in Q. lra.
Qed.

(* 1 - cos x <= x^2 / 2 *)
Lemma versine : forall x, 1 - cos x <= x * x / 2.
Proof.
  intro x. replace x with (2 * (x / 2)) at 1 by lra. rewrite cos_2a_sin.
  pose proof (sine_square (x / 2)). lra.
Qed.

(* the series of the sine, five terms of it, by the alternating bound of the standard library *)
Lemma sine_cubic : forall h, 0 <= h <= 1 -> h - h * h * h / 6 <= sin h <= h - h * h * h / 6 + h * h * h * h * h / 120.
Proof.
  intros h H. pose proof (pre_sin_bound h 0 ltac:(lra) ltac:(lra)) as [A B].
  unfold sin_approx, sum_f_R0, sin_term in A, B. simpl in A, B. split; [clear B | clear A].
  - eapply Rle_trans; [| exact A]. right. field.
  - eapply Rle_trans; [exact B |]. right. field.
Qed.

Lemma Rabs_within : forall x c, Rabs x <= c -> - c <= x <= c.
Proof. intros x c H. unfold Rabs in H. destruct (Rcase_abs x); lra. Qed.
