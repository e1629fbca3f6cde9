(* L along the closed loop of the paper's law: T11 and T12. *)
From Coq Require Import Reals Lra.
Require Import Basics Functions Norms Statements Plant.
Open Scope R_scope.

Theorem T11_all_holds : T11_all.
Proof.
  unfold T11_all. intros * L. unfold paper_loop in L. destruct L as [P L]. parts.
  said outer_loop_holds of P as Out. destruct Out as [A1 [A2 A3]].
  said inner_loop_holds of P as In. destruct In as [N1 [N2 N3]].
  assert (K : rb1 * (jd11 * rb1 + jd12 * rb2 + jd13 * rb3) + rb2 * (jd21 * rb1 + jd22 * rb2 + jd23 * rb3) + rb3 * (jd31 * rb1 + jd32 * rb2 + jd33 * rb3)
    = 2 * (rb1 * (c11 * rb1 + c12 * rb2 + c13 * rb3) + rb2 * (c21 * rb1 + c22 * rb2 + c23 * rb3) + rb3 * (c31 * rb1 + c32 * rb2 + c33 * rb3))).
  { pose proof skew_holds as S. unfold skew in S. eapply S. exact P. }
  clear P.
  assert (B1 : j11 * rbd1 + j12 * rbd2 + j13 * rbd3 = j11 * (lb1 * rb1) + j12 * (lb2 * rb2) + j13 * (lb3 * rb3) - (c11 * rb1 + c12 * rb2 + c13 * rb3)
    + ((wb11 - ub11) * mub1 + (wb21 - ub21) * mub2) + db1 - kb1 * rb1 - ib1 * nb1).
  { transitivity (j11 * (rbd1 + acc1) + j12 * (rbd2 + acc2) + j13 * (rbd3 + acc3) + (c11 * q1 + c12 * q2 + c13 * q3)
      - (j11 * acc1 + j12 * acc2 + j13 * acc3 + (c11 * q1 + c12 * q2 + c13 * q3))); [ring |].
    rewrite N1. unfolded b1. unfolded tau1. unfolded rbd1. unfolded rbd2. unfolded rbd3. ring. }
  assert (B2 : j21 * rbd1 + j22 * rbd2 + j23 * rbd3 = j21 * (lb1 * rb1) + j22 * (lb2 * rb2) + j23 * (lb3 * rb3) - (c21 * rb1 + c22 * rb2 + c23 * rb3)
    + ((wb12 - ub12) * mub1 + (wb22 - ub22) * mub2) + db2 - kb2 * rb2 - ib2 * nb2).
  { transitivity (j21 * (rbd1 + acc1) + j22 * (rbd2 + acc2) + j23 * (rbd3 + acc3) + (c21 * q1 + c22 * q2 + c23 * q3)
      - (j21 * acc1 + j22 * acc2 + j23 * acc3 + (c21 * q1 + c22 * q2 + c23 * q3))); [ring |].
    rewrite N2. unfolded b2. unfolded tau2. unfolded rbd1. unfolded rbd2. unfolded rbd3. ring. }
  assert (B3 : j31 * rbd1 + j32 * rbd2 + j33 * rbd3 = j31 * (lb1 * rb1) + j32 * (lb2 * rb2) + j33 * (lb3 * rb3) - (c31 * rb1 + c32 * rb2 + c33 * rb3)
    + ((wb13 - ub13) * mub1 + (wb23 - ub23) * mub2) + db3 - kb3 * rb3 - ib3 * nb3).
  { transitivity (j31 * (rbd1 + acc1) + j32 * (rbd2 + acc2) + j33 * (rbd3 + acc3) + (c31 * q1 + c32 * q2 + c33 * q3)
      - (j31 * acc1 + j32 * acc2 + j33 * acc3 + (c31 * q1 + c32 * q2 + c33 * q3))); [ring |].
    rewrite N3. unfolded b3. unfolded tau3. unfolded rbd1. unfolded rbd2. unfolded rbd3. ring. }
  match goal with |- ?t1 + ?t2 + ?t3 + ?t4 + ?t5 + ?t6 + ?t7 + ?t8 = _ =>
    replace t1 with (ra1 * (m * rad1) + ra2 * (m * rad2) + ra3 * (m * rad3)) by ring; rewrite A1, A2, A3, B1, B2, B3, K;
    replace t5 with (na1 * (ia1 * ra1) + na2 * (ia2 * ra2) + na3 * (ia3 * ra3)) by (field; not_zero);
    replace t6 with (nb1 * (ib1 * rb1) + nb2 * (ib2 * rb2) + nb3 * (ib3 * rb3)) by (field; not_zero);
    replace t7 with (kappa * n * ((wa11 - ua11) * ua11 + (wa12 - ua12) * ua12 + (wa13 - ua13) * ua13 + (wa21 - ua21) * ua21 + (wa22 - ua22) * ua22 + (wa23 - ua23) * ua23)
      - (ra1 * ((wa11 - ua11) * mua1 + (wa21 - ua21) * mua2) + ra2 * ((wa12 - ua12) * mua1 + (wa22 - ua22) * mua2) + ra3 * ((wa13 - ua13) * mua1 + (wa23 - ua23) * mua2)))
      by (field; split; not_zero);
    replace t8 with (kappa * n * ((wb11 - ub11) * ub11 + (wb12 - ub12) * ub12 + (wb13 - ub13) * ub13 + (wb21 - ub21) * ub21 + (wb22 - ub22) * ub22 + (wb23 - ub23) * ub23)
      - (rb1 * ((wb11 - ub11) * mub1 + (wb21 - ub21) * mub2) + rb2 * ((wb12 - ub12) * mub1 + (wb22 - ub22) * mub2) + rb3 * ((wb13 - ub13) * mub1 + (wb23 - ub23) * mub2)))
      by (field; split; not_zero)
  end.
  match goal with |- context [1 / 2 * (2 * ?x)] => replace (1 / 2 * (2 * x)) with x by field end.
  ring.
Qed.

Theorem T11_holds : T11.
Proof.
  unfold T11. intros * L A B. pose proof T11_all_holds as F. unfold T11_all in F. pose proof L as E.
  apply F with (kappa := kappa) in E. rewrite E. clear E F.
  unfold paper_loop in L. destruct L as [P _]. said no_series_holds of P as S; try assumption.
  destruct S as [S1 [S2 S3]]. rewrite S1, S2, S3. match goal with |- ?i + ?x = _ => replace x with 0 by ring end. apply Rplus_0_r.
Qed.

Theorem T11_near_holds : T11_near.
Proof.
  unfold T11_near. intros * L. pose proof T11_all_holds as F. unfold T11_all in F. pose proof L as E.
  apply F with (kappa := kappa) in E. rewrite E. clear E F.
  unfold paper_loop in L. destruct L as [P _]. said thrust_holds of P as U. said series_holds of P as S. destruct S as [S1 [S2 S3]].
  match goal with |- Rabs (?i + ?x - ?i) <= _ => replace (i + x - i) with x by ring end. apply left_by_series; assumption.
Qed.

Lemma bounded_paper : forall i1 i2 i3 i4 i5 i6 i7 i8 i9 x b1 b2 b3 b4 b5 b6 b7 b8 b9 b10, i1 <= b1 -> i2 <= b2 + b3 -> i3 <= b4 -> i4 + i5 <= b5 ->
  i6 <= b6 -> i7 <= b7 + b8 -> i8 + x <= b9 -> i9 <= b10 ->
  i1 + i2 + i3 + i4 + i5 + i6 + i7 + i8 + i9 + x <= b1 + b2 + b3 + b4 + b5 + b6 + b7 + b8 + b9 + b10.
Proof. intros. lra. Qed.

Theorem T12_holds : T12.
Proof.
  unfold T12. intros * L. intros. pose proof T11_all_holds as F. unfold T11_all in F. pose proof L as E.
  apply F with (kappa := kappa) in E. rewrite E. clear E F.
  unfold paper_loop in L. destruct L as [P L]. assert (F : n = sqrt (ra1 * ra1 + ra2 * ra2 + ra3 * ra3 + (rb1 * rb1 + rb2 * rb2 + rb3 * rb3)) /\ 0 < pp1)
    by (parts; split; [assumption | apply Rgt_lt; assumption]). destruct F as [NN PP]. clear L.
  said thrust_holds of P as U.
  match goal with H : least1 = _ |- _ => destruct (least_of_three _ _ _ _ H) as [D1 [D2 D3]] end.
  match goal with H : least2 = _ |- _ => destruct (least_of_three _ _ _ _ H) as [K1 [K2 K3]] end.
  match goal with H : leastp = _ |- _ => destruct (least_of_three _ _ _ _ H) as [L1 [L2 L3]] end.
  match goal with H : most2 = _ |- _ => destruct (most_of_three _ _ _ _ H) as [M1 [M2 M3]] end.
  match goal with H : sigma = _ |- _ => destruct (most_of_three _ _ _ _ H) as [S1 [S2 S3]] end.
  apply bounded_paper.
  - apply (weighted_length _ (ka1 - m * la1) (ka2 - m * la2) (ka3 - m * la3)); assumption.
  - assert (G : (least2 - 2 * sigma * most2) * (rb1 * rb1 + rb2 * rb2 + rb3 * rb3) <= rb1 * (kb1 * rb1) + rb2 * (kb2 * rb2) + rb3 * (kb3 * rb3)
      - (rb1 * (j11 * (lb1 * rb1) + j12 * (lb2 * rb2) + j13 * (lb3 * rb3)) + rb2 * (j21 * (lb1 * rb1) + j22 * (lb2 * rb2) + j23 * (lb3 * rb3))
         + rb3 * (j31 * (lb1 * rb1) + j32 * (lb2 * rb2) + j33 * (lb3 * rb3)))).
    { pose proof gain_holds as G. unfold gain in G. eapply G; try eassumption. }
    match goal with H : len2 = _ |- _ => pose proof (length_square _ _ _ _ H) as Q end. rewrite <- Q in G.
    match type of G with _ <= ?a - ?b => set (X := a) in *; set (Y := b) in * end. clearbody X Y. lra.
  - match goal with |- - ?t <= _ => replace t with (e1 * (pp1 * lb1 * e1) + e2 * (pp1 * lb2 * e2) + e3 * (pp1 * lb3 * e3)) by ring end.
    apply weighted_length; assumption.
  - apply cauchy6; assumption.
  - apply cauchy3; assumption.
  - match goal with |- _ <= ?k * ?we * ?wi + - _ => replace (k * we * wi + - (k * we * we)) with (k * (we * wi - we * we)) by ring end.
    apply Rmult_le_compat_l.
    + apply Rmult_le_pos; [lra |]. rewrite NN. apply sqrt_pos.
    + apply forgetting; assumption.
  - match goal with |- u * ?a + u * ?b <= _ => replace (u * a + u * b) with (u * (a + b)) by ring end. rewrite (Rmult_assoc u len1 lene). apply Rmult_le_compat_l; [exact U |].
    said turning_holds of P as T.
    match type of T with ?a * _ + ?b * _ + ?c * _ <= _ => set (g1 := a) in *; set (g2 := b) in *; set (g3 := c) in * end.
    match goal with |- ?t <= _ => replace t with (ra1 * g1 + ra2 * g2 + ra3 * g3) by ring end. clearbody g1 g2 g3.
    eapply Rle_trans; [eapply cauchy3; [eassumption | reflexivity] |]. apply Rmult_le_compat_l.
    + match goal with H : len1 = _ |- _ => rewrite H end. apply sqrt_pos.
    + match goal with H : lene = _ |- _ => rewrite H end. apply sqrt_le_1_alt. pose proof (Rle_0_sqr e1) as Q. unfold Rsqr in Q. lra.
  - match goal with |- ?t <= _ => replace t with (pp1 * (e1 * rb1 + e2 * rb2 + e3 * rb3)) by ring end. rewrite (Rmult_assoc pp1 lene len2).
    apply Rmult_le_compat_l; [lra |]. apply cauchy3; assumption.
Qed.
