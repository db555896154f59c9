!! One step of an explicit Runge-Kutta method in one mode as a linear map; see razy_runge_kutta_methods_step_maps.
!!
!! Its columns are the sums of the stages begun with unit vectors.
module razy_runge_kutta_methods_step_map
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_folded_stages, only: phases, stages
   use razy_runge_kutta_methods_stage_sums, only: add_up, width
   use razy_runge_kutta_methods_tableaux, only: tableau_t
   implicit none(type, external)
   private

   public :: step_map_t

   !> One step in one mode: how often it has served, and then Δ and E, and D (four rows, columns, blocks of rows), and cosine and
   !> sine of the angles of excitation in the step (tones each).
   type :: step_map_t
      real(wp) :: h = 0.0_wp
      integer :: uses = 0
      logical :: made = .false.
      real(wp), allocatable :: ends(:, :, :), dense(:, :, :), cosine(:), sine(:)
   contains
      procedure :: make
   end type step_map_t

contains

   !> Form the map of the step h, column by column.
   subroutine make(map, field, tableau, columns)
      class(step_map_t), intent(inout) :: map
      type(field_t), intent(in) :: field
      type(tableau_t), intent(in) :: tableau
      integer, intent(in) :: columns

      real(wp), dimension(4*((2*field%m + 3)/4)) :: z0, z, sum
      real(wp) :: k(size(z0), tableau%stages + 1 + tableau%extra), part(field%m, size(k, 2))
      real(wp) :: ends(width*blocks(2*field%m*(1 + tableau%errors))), dense(width*blocks(2*field%m*tableau%polynomials))
      integer :: column, e, m, n

      m = field%m
      n = 2*m
      map%made = .true.
      if (allocated(map%ends)) deallocate (map%ends, map%dense, map%cosine, map%sine)
      allocate (map%cosine(size(field%omega)), map%sine(size(field%omega)))
      allocate (map%ends(width, columns, size(ends)/width), map%dense(width, columns, size(dense)/width))
      ends = 0.0_wp
      dense = 0.0_wp
      do column = 1, columns
         z0 = 0.0_wp
         k = 0.0_wp
         part = 0.0_wp
         if (column <= n) k(column, 1) = 1.0_wp
         if (column <= m) then
            ! The velocity goes on as it was, and what it does to the acceleration at the start is in that already.
            z0(m + column) = 1.0_wp
            part = spread(field%matrix(:, m + column), 2, size(k, 2))
         else if (column <= n) then
            part(column - m, :) = 1.0_wp
         else
            call force_of_phase(map, field, tableau, column - n, part)
         end if
         call stages(m, size(z0), tableau, map%h, 2, size(k, 2), field%matrix, part, z0, k, z)
         call add_up(k, tableau%row(tableau%stages + 1), sum)
         ends(:n) = map%h*sum(:n)
         do e = 1, tableau%errors
            call add_up(k, tableau%error(e), sum)
            ends(n*e + 1:n*e + n) = map%h*sum(:n)
         end do
         do e = 1, tableau%polynomials
            call add_up(k, tableau%dense(e), sum)
            dense(n*(e - 1) + 1:n*e) = map%h*sum(:n)
         end do
         map%ends(:, column, :) = reshape(ends, [width, size(map%ends, 3)])
         map%dense(:, column, :) = reshape(dense, [width, size(map%dense, 3)])
      end do
   end subroutine make

   !> How the forcing of all stages differs from that at the start (m, stages), where all phases at the start are 0 but number i
   !> of all cosines and then all sines, which is 1.
   subroutine force_of_phase(map, field, tableau, i, part)
      class(step_map_t), intent(inout) :: map
      type(field_t), intent(in) :: field
      type(tableau_t), intent(in) :: tableau
      integer, intent(in) :: i
      real(wp), intent(out) :: part(:, :)

      real(wp) :: c(size(part, 2)), d(size(part, 2)), start(2)
      integer :: j, last, t

      last = tableau%stages + 1
      t = modulo(i - 1, size(field%omega)) + 1
      start = merge([1.0_wp, 0.0_wp], [0.0_wp, 1.0_wp], i == t)
      call phases(field%omega(t), tableau%node(:last)*map%h, start(1), start(2), c(:last), d(:last))
      call phases(field%omega(t), tableau%node(last + 1:size(c))*map%h, start(1), start(2), c(last + 1:), d(last + 1:))
      do j = 1, size(c)
         part(:, j) = field%on_cosine(:, t)*(c(j) - start(1)) + field%on_sine(:, t)*(d(j) - start(2))
      end do
      if (i /= t) return
      map%cosine(t) = c(last)
      map%sine(t) = d(last)
   end subroutine force_of_phase

   !> Blocks of four that n rows need.
   pure function blocks(n)
      integer, intent(in) :: n
      integer :: blocks

      blocks = (n + width - 1)/width
   end function blocks

end module razy_runge_kutta_methods_step_map
