!! Explicit Runge-Kutta methods as data: one type holds every tableau, one engine (razy_runge_kutta_methods_stepper) runs them.
!!
!! Stage i of a step from z with slope k_1 is k_i = f(t + c_i h, z + h Σ_j a_ij k_j); row `stages` + 1 of a is the row of weights,
!! so that k_(stages+1) = f(t + h, z(t + h)) is the first stage of the next step in every method. Rows after that are
!! stages that only the dense output needs. Error estimates and dense output are sums h Σ_j e_j k_j, h Σ_j d_j k_j.
!!
!! Dense output, θ in [0, 1], after Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993),
!! II.6: z(θ) = z_0 + θ(r_1 + (1-θ)(r_2 + θ(r_3 + (1-θ)(r_4 + …)))) with r_1 = z_1 - z_0, r_2 = h k_1 - r_1,
!! r_3 = r_1 - h k_(stages+1) - r_2; r_4… are the sums of the d. Without them it is the cubic Hermite polynomial.
module razy_runge_kutta_methods_tableaux
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: explicit_methods, new_tableau, sum_t, tableau_t

   character(*), parameter :: explicit_methods(*) = [character(16) :: "rk4", "bogacki_shampine", "dormand_prince", "dop853"]

   !> Σ_j value_j k_column(j).
   type :: sum_t
      integer :: terms = 0
      integer :: column(16) = 0
      real(wp) :: value(16) = 0.0_wp
   end type sum_t

   !> A method.
   type :: tableau_t
      !> Order of the result and of the dense output; the error estimate is of order `estimate` in h (0: there is none).
      integer :: order = 0, dense_order = 0, estimate = 0
      !> Right-hand sides of a step, and additional ones for the dense output.
      integer :: stages = 0, extra = 0
      !> Whether the error estimate needs the slope at the end of the step ("first same as last").
      logical :: fsal = .false.
      !> Weight of the integral part of step control, bounds of the factor from step to step.
      real(wp) :: beta = 0.0_wp, least = 0.2_wp, most = 10.0_wp
      !> Nodes, rows (stages + 1 + extra).
      real(wp) :: node(16) = 0.0_wp
      type(sum_t) :: row(16)
      !> Estimates of the error (`errors`), coefficients r_4… of the dense output (`polynomials`).
      integer :: errors = 0, polynomials = 0
      type(sum_t) :: error(2), dense(4)
   end type tableau_t

contains

   !> The tableau of one of `explicit_methods`, or what the implicit `radau5` has of it.
   subroutine new_tableau(self, name)
      type(tableau_t), intent(out) :: self
      character(*), intent(in) :: name

      select case (name)
      case ("rk4")
         call classical(self)
      case ("bogacki_shampine")
         call bogacki_shampine(self)
      case ("dormand_prince")
         call dormand_prince(self)
      case ("dop853")
         call dop853(self)
      case default
         self = tableau_t(order=5, dense_order=4, estimate=4, stages=3, polynomials=1, most=8.0_wp)
      end select
   end subroutine new_tableau

   !> Kutta's method of order 4 (Z. Math. Phys. 46 (1901) 435-453).
   pure subroutine classical(self)
      type(tableau_t), intent(inout) :: self

      self = tableau_t(order=4, dense_order=3, stages=4)
      call set_row(self, 2, 0.5_wp, [1], [0.5_wp])
      call set_row(self, 3, 0.5_wp, [2], [0.5_wp])
      call set_row(self, 4, 1.0_wp, [3], [1.0_wp])
      call set_row(self, 5, 1.0_wp, [1, 2, 3, 4], [1.0_wp/6, 1.0_wp/3, 1.0_wp/3, 1.0_wp/6])
   end subroutine classical

   !> Order 3(2): P. Bogacki, L. F. Shampine, Appl. Math. Lett. 2 (1989) 321-325.
   pure subroutine bogacki_shampine(self)
      type(tableau_t), intent(inout) :: self

      self = tableau_t(order=3, dense_order=3, estimate=3, errors=1, beta=0.4_wp/6, stages=3, fsal=.true.)
      call set_row(self, 2, 0.5_wp, [1], [0.5_wp])
      call set_row(self, 3, 0.75_wp, [2], [0.75_wp])
      call set_row(self, 4, 1.0_wp, [1, 2, 3], [2.0_wp/9, 1.0_wp/3, 4.0_wp/9])
      call set_sum(self%error(1), [1, 2, 3, 4], [-5.0_wp/72, 1.0_wp/12, 1.0_wp/9, -1.0_wp/8])
   end subroutine bogacki_shampine

   !> Order 5(4): J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26; dense output of order 4 after Hairer,
   !> Nørsett and Wanner I, II.6.
   pure subroutine dormand_prince(self)
      type(tableau_t), intent(inout) :: self

      self = tableau_t(order=5, dense_order=4, estimate=5, errors=1, polynomials=1, beta=0.04_wp, stages=6, fsal=.true.)
      call set_row(self, 2, 0.2_wp, [1], [0.2_wp])
      call set_row(self, 3, 0.3_wp, [1, 2], [3.0_wp/40, 9.0_wp/40])
      call set_row(self, 4, 0.8_wp, [1, 2, 3], [44.0_wp/45, -56.0_wp/15, 32.0_wp/9])
      call set_row(self, 5, 8.0_wp/9, [1, 2, 3, 4], [19372.0_wp/6561, -25360.0_wp/2187, 64448.0_wp/6561, -212.0_wp/729])
      call set_row(self, 6, 1.0_wp, [1, 2, 3, 4, 5], &
                   [9017.0_wp/3168, -355.0_wp/33, 46732.0_wp/5247, 49.0_wp/176, -5103.0_wp/18656])
      call set_row(self, 7, 1.0_wp, [1, 3, 4, 5, 6], &
                   [35.0_wp/384, 500.0_wp/1113, 125.0_wp/192, -2187.0_wp/6784, 11.0_wp/84])
      call set_sum(self%error(1), [1, 3, 4, 5, 6, 7], [71.0_wp/57600, -71.0_wp/16695, 71.0_wp/1920, -17253.0_wp/339200, &
                                                       22.0_wp/525, -1.0_wp/40])
      call set_sum(self%dense(1), [1, 3, 4, 5, 6, 7], &
                   [-12715105075.0_wp/11282082432.0_wp, 87487479700.0_wp/32700410799.0_wp, -10690763975.0_wp/1880347072.0_wp, &
                    701980252875.0_wp/199316789632.0_wp, -1453857185.0_wp/822651844.0_wp, 69997945.0_wp/29380423.0_wp])
   end subroutine dormand_prince

   !> Order 8 with error estimates of orders 5 and 3 and dense output of order 7: Hairer, Nørsett and Wanner I, II.5, II.6 (Dormand
   !> and Prince's method with new error estimates).
   pure subroutine dop853(self)
      type(tableau_t), intent(inout) :: self

      ! Hairer's program takes beta = 0; with this nothing is rejected on smooth motions, and equal errors cost an eighth less.
      self = tableau_t(order=8, dense_order=7, estimate=8, errors=2, polynomials=4, beta=0.04_wp, least=0.333_wp, most=6.0_wp, &
                       stages=12, extra=3)
      call set_row(self, 2, 2*(6 - sqrt(6.0_wp))/135, [1], [ &
                   5.260015195876773187856e-2_wp])
      call set_row(self, 3, (6 - sqrt(6.0_wp))/45, [1, 2], [ &
                   1.972505698453789945446e-2_wp, 5.917517095361369836338e-2_wp])
      call set_row(self, 4, (6 - sqrt(6.0_wp))/30, [1, 3], [ &
                   2.958758547680684918169e-2_wp, 8.876275643042054754507e-2_wp])
      call set_row(self, 5, (6 + sqrt(6.0_wp))/30, [1, 3, 4], [ &
                   2.413651341592666855024e-1_wp, -8.845494793282860853449e-1_wp, 9.248340032617920031157e-1_wp])
      call set_row(self, 6, 1.0_wp/3, [1, 4, 5], [ &
                   3.703703703703703703704e-2_wp, 1.708286087294738712796e-1_wp, 1.254676875668224250167e-1_wp])
      call set_row(self, 7, 0.25_wp, [1, 4, 5, 6], [ &
                   3.7109375e-2_wp, 1.70252211019544039315e-1_wp, 6.021653898045596068502e-2_wp, -1.7578125e-2_wp])
      call set_row(self, 8, 4.0_wp/13, [1, 4, 5, 6, 7], [ &
                   3.709200011850479271088e-2_wp, 1.703839257122399938102e-1_wp, 1.072620304463732846518e-1_wp, &
                   -1.531943774862440175279e-2_wp, 8.273789163814022887585e-3_wp])
      call set_row(self, 9, 127.0_wp/195, [1, 4, 5, 6, 7, 8], [ &
                   6.241109587160757171144e-1_wp, -3.360892629446941294069_wp, -8.682193468417260068182e-1_wp, &
                   2.759209969944670830494e1_wp, 2.015406755047789340862e1_wp, -4.348988418106995884774e1_wp])
      call set_row(self, 10, 0.6_wp, [1, 4, 5, 6, 7, 8, 9], [ &
                   4.776625364382643658904e-1_wp, -2.488114619971667641926_wp, -5.902908268368429963714e-1_wp, &
                   2.123005144818119423473e1_wp, 1.527923363288242358326e1_wp, -3.328821096898486291945e1_wp, &
                   -2.033120170850862613582e-2_wp])
      call set_row(self, 11, 6.0_wp/7, [1, 4, 5, 6, 7, 8, 9, 10], [ &
                  -9.37142430085987325717e-1_wp, 5.1863724288440637083_wp, 1.091437348996729578185_wp, -8.14978701074692612514_wp, &
               -1.852006565999695986416e1_wp, 2.27394870993505042819e1_wp, 2.493605552679652389871_wp, -3.046764471898219500382_wp])
      call set_row(self, 12, 1.0_wp, [1, 4, 5, 6, 7, 8, 9, 10, 11], [ &
                   2.273310147516538207924_wp, -1.053449546673725019841e1_wp, -2.000872058224862499097_wp, &
                   -1.795893186311879891728e1_wp, 2.794888452941996005085e1_wp, -2.858998277135023694741_wp, &
                   -8.872856933530629544335_wp, 1.236056717579430306473e1_wp, 6.43392746015763530356e-1_wp])
      call set_row(self, 13, 1.0_wp, [1, 6, 7, 8, 9, 10, 11, 12], [ &
               5.429373411656876223805e-2_wp, 4.450312892752408881441_wp, 1.891517899314500383043_wp, -5.801203960010584781467_wp, &
                   3.111643669578198944089e-1_wp, -1.521609496625160785562e-1_wp, 2.013654008040303483748e-1_wp, &
                   4.471061572777259051769e-2_wp])
      call set_row(self, 14, 0.1_wp, [1, 7, 8, 9, 10, 11, 12, 13], [ &
                   5.616750228304795233929e-2_wp, 2.535002102166248110888e-1_wp, -2.462390374708024899174e-1_wp, &
                   -1.24191423263816360469e-1_wp, 1.532917982787656973121e-1_wp, 8.201052295634689884917e-3_wp, &
                   7.567897660545699761386e-3_wp, -8.298e-3_wp])
      call set_row(self, 15, 0.2_wp, [1, 6, 7, 8, 11, 12, 13, 14], [ &
                   3.183464816350214050608e-2_wp, 2.830090967236677552883e-2_wp, 5.354198830743856762238e-2_wp, &
                   -5.492374857139098846466e-2_wp, -1.083473286972493228585e-4_wp, 3.825710908356584129549e-4_wp, &
                   -3.40465008687404560803e-4_wp, 1.413124436746325002781e-1_wp])
      call set_row(self, 16, 7.0_wp/9, [1, 6, 7, 8, 9, 13, 14, 15], [ &
              -4.288963015837919234086e-1_wp, -4.697621415361163843144_wp, 7.683421196062599041842_wp, 4.068989818397110079702_wp, &
                   3.567271874552811092707e-1_wp, -1.399024165159014621294e-3_wp, 2.947514789152772338956_wp, &
                   -9.150958472179870010819_wp])
      call dop853_errors(self)
      call set_sum(self%dense(1), [1, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16], [ &
               -8.428938276109012865135_wp, 5.667149535193777696253e-1_wp, -3.06894994594989169128_wp, 2.384667656512069828773_wp, &
                   2.117034582445028276716_wp, -8.713915837779729920679e-1_wp, 2.240437430260788275854_wp, &
                   6.315787787694688181557e-1_wp, -8.89903364513333108207e-2_wp, 1.814850552085472725666e1_wp, &
                   -9.194632392478355400045_wp, -4.436036387594893966431_wp])
      call set_sum(self%dense(2), [1, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16], [ &
                   1.042750864257913460341e1_wp, 2.422834917752581828843e2_wp, 1.652004517172702819851e2_wp, &
                   -3.745467547226902027952e2_wp, -2.211366685312530603627e1_wp, 7.73343266847226383896_wp, &
                   -3.067408473108939818206e1_wp, -9.332130526430227872957_wp, 1.569723812177084388613e1_wp, &
                   -3.113940321956517767728e1_wp, -9.352924358844478386571_wp, 3.581684148639408375247e1_wp])
      call set_sum(self%dense(3), [1, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16], [ &
                   1.998505324200243382099e1_wp, -3.870373087493517655511e2_wp, -1.891781381951675688283e2_wp, &
                   5.278081592054236490056e2_wp, -1.157390253995963012614e1_wp, 6.881232694696300016967_wp, &
                   -1.000605096691083840318_wp, 7.777137798053443209287e-1_wp, -2.778205752353508406593_wp, &
                   -6.019669523126412075827e1_wp, 8.432040550667716101816e1_wp, 1.199229113618278932804e1_wp])
      call set_sum(self%dense(4), [1, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16], [ &
                   -2.569393346270374900331e1_wp, -1.541897486902364337405e2_wp, -2.315293791760454956754e2_wp, &
                   3.576391179106141237829e2_wp, 9.340532418362431000391e1_wp, -3.745832313645163315688e1_wp, &
                   1.040996495089623004515e2_wp, 2.984029342666050312334e1_wp, -4.353345659001114375443e1_wp, &
                   9.632455395918828294839e1_wp, -3.917726167561543916523e1_wp, -1.497268362579856258142e2_wp])
   end subroutine dop853

   pure subroutine dop853_errors(self)
      type(tableau_t), intent(inout) :: self

      call set_sum(self%error(1), [1, 6, 7, 8, 9, 10, 11, 12], [ &
                   1.31200449941948807325e-2_wp, -1.225156446376204440721_wp, -4.957589496572501915214e-1_wp, &
                   1.664377182454986536962_wp, -3.503288487499736816886e-1_wp, 3.341791187130174790297e-1_wp, &
                   8.192320648511571246571e-2_wp, -2.235530786388629525884e-2_wp])
      ! The weights less those of a method of order 3 on the nodes of stages 1, 9 and 12.
      self%error(2) = self%row(13)
      associate (column => self%error(2)%column, value => self%error(2)%value)
         where (column == 1) value = value - 0.244094488188976377952755905512_wp
         where (column == 9) value = value - 0.733846688281611857341361741547_wp
         where (column == 12) value = value - 0.220588235294117647058823529412e-1_wp
      end associate
   end subroutine dop853_errors

   pure subroutine set_row(self, i, node, column, value)
      type(tableau_t), intent(inout) :: self
      integer, intent(in) :: i, column(:)
      real(wp), intent(in) :: node, value(:)

      self%node(i) = node
      call set_sum(self%row(i), column, value)
   end subroutine set_row

   pure subroutine set_sum(self, column, value)
      type(sum_t), intent(inout) :: self
      integer, intent(in) :: column(:)
      real(wp), intent(in) :: value(:)

      self%terms = size(column)
      self%column(:self%terms) = column
      self%value(:self%terms) = value
   end subroutine set_sum

end module razy_runge_kutta_methods_tableaux
